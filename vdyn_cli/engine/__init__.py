"""One symbolic model in, simulation with exact sensitivities out: the only room that integrates."""
