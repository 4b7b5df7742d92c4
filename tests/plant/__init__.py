"""The truth plant: makes the logs of a test day from a vehicle whose every parameter is known.

Independent on purpose: nothing here imports ``vdyn_cli`` or repeats its equations, and it integrates in its own ways.
SI units; x forward, z up; pitch nose-up positive; headwind positive against motion; grade positive uphill.

Each test's module offers ``truth(vehicle)``, ``campaign(vehicle, seed, effects={...})`` (the logs, noise and all),
``noise_free(...)``, and ``information(vehicle, seed, effects={...}, unknowns=(...))``, whose ``bound()`` is the
Cramer-Rao bound, ``unknowns`` being effects whose sizes are unknown as well (of coast-downs and drives:
``coast_information``, ``drive_information``). ``hidden.Scenario`` tells how strongly logs could show what is hidden in
them. ``known(vehicle)``, where there is one, is what the tester may write
down; ``samples()`` makes the files of sample_logs/. ``python -m tests.plant.write sample_logs`` writes them all.
"""
