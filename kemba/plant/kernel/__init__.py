"""The plant's inner loop, compiled by numba: steps, contact forces, events, controller, record.

It knows no model: the physics comes as the addresses of a model's machine code
(`kemba.machine_code`), so these functions are compiled once per computer. Numba takes
half a second to import: import from here only inside functions that simulate.
"""
