"""stub"""
from exugear.gearbox.elastic_shaft import elastic_shaft
MODES = 1
def flexibility(gearbox, shafts):
    e = {s.name: elastic_shaft(s, MODES, axial=any(st.pair.beta_b for st in gearbox.stages if s in st.shafts)) for s in gearbox.shafts if s.sections and s.bearings}
    return e, {n: f"{x.elastic} elastic coordinates" for n,x in e.items()}
