"""Plots: each function takes data and optionally axes, and returns the axes."""

from exugear.plots.branch_plots import plot_branches
from exugear.plots.design_plots import flank_drawing, plot_flank, plot_landscape, plot_pareto_front
from exugear.plots.diagnosis_plots import (
    plot_condition_indicators,
    plot_envelope_spectrum,
    plot_synchronous_average,
)
from exugear.plots.face_plots import plot_bearing_loads, plot_line_load, plot_shaft_deflection
from exugear.plots.figures import DISTINCT, figure
from exugear.plots.flank_plots import plot_contact_pattern, plot_load_distribution
from exugear.plots.gearbox_drawing import plot_gearbox
from exugear.plots.load_plots import plot_dynamic_factor, plot_dynamic_stress, plot_load_factors
from exugear.plots.map_plots import plot_load_sharing, plot_ring_stiffness, plot_ste, plot_stiffness, plot_te_harmonics
from exugear.plots.mesh_plots import plot_section, plot_solid
from exugear.plots.mode_plots import plot_campbell, plot_modes
from exugear.plots.order_plots import (
    plot_levels,
    plot_mesh_order_map,
    plot_order_cuts,
    plot_order_map,
    plot_spectrogram,
    plot_waterfall,
)
from exugear.plots.power_plots import plot_efficiency, plot_power
from exugear.plots.run_plots import plot_bearing_forces, plot_envelopes, plot_mesh_force, plot_orbit, plot_run_up
from exugear.plots.set_plots import plot_mesh_phases, plot_phase_sums, plot_planet_shares, plot_side_bands
from exugear.plots.stress_plots import (
    plot_field,
    plot_gears,
    plot_outlines,
    plot_peak_pressure,
    plot_pressure,
    plot_root_stress,
)

__all__ = [
    "DISTINCT",
    "figure",
    "flank_drawing",
    "plot_bearing_forces",
    "plot_bearing_loads",
    "plot_branches",
    "plot_campbell",
    "plot_condition_indicators",
    "plot_contact_pattern",
    "plot_dynamic_factor",
    "plot_dynamic_stress",
    "plot_efficiency",
    "plot_envelope_spectrum",
    "plot_envelopes",
    "plot_field",
    "plot_flank",
    "plot_gearbox",
    "plot_gears",
    "plot_landscape",
    "plot_levels",
    "plot_line_load",
    "plot_load_distribution",
    "plot_load_factors",
    "plot_load_sharing",
    "plot_mesh_force",
    "plot_mesh_order_map",
    "plot_mesh_phases",
    "plot_modes",
    "plot_orbit",
    "plot_order_cuts",
    "plot_order_map",
    "plot_outlines",
    "plot_pareto_front",
    "plot_peak_pressure",
    "plot_phase_sums",
    "plot_planet_shares",
    "plot_power",
    "plot_pressure",
    "plot_ring_stiffness",
    "plot_root_stress",
    "plot_run_up",
    "plot_section",
    "plot_shaft_deflection",
    "plot_side_bands",
    "plot_solid",
    "plot_spectrogram",
    "plot_ste",
    "plot_stiffness",
    "plot_synchronous_average",
    "plot_te_harmonics",
    "plot_waterfall",
]


def __dir__() -> list[str]:
    return __all__


def __getattr__(name: str):
    """A name of earlier versions."""
    if name == "plot_cascade":
        from exugear.plots.order_plots import plot_cascade

        return plot_cascade
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
