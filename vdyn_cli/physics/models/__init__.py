"""Models: assemblies of laws, the equations of motion that the steps fit."""
