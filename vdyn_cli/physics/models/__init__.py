"""Assemblies of elements: the equations of motion that the steps fit."""
