"""The truth plant: makes the logs of a test day from a vehicle whose every parameter is known.

Independent on purpose: nothing here imports ``vdyn_cli`` or repeats its equations, and it integrates in its own ways.
SI units; x forward, z up; pitch nose-up positive; headwind positive against motion; grade positive uphill.
"""
