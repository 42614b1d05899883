"""Figure of the nine lines in the README, drawn by these lines themselves.

python examples/figures/nine_lines.py examples/figures
"""

import re
import sys
from pathlib import Path

from palette import save_small

README = Path(__file__).parents[2] / "README.md"


def draw():
    code = re.search(r"```python\n(.*?)```", README.read_text(encoding="utf-8"), re.DOTALL).group(1)
    names: dict = {}
    exec(code.rsplit("\n", 2)[0], names)
    figure = names["exugear"].plots.plot_run_up(names["run"]).figure
    figure.set_size_inches(7.0, 3.5)
    return figure


if __name__ == "__main__":
    save_small(draw(), Path(sys.argv[1]) / "nine_lines.png")
