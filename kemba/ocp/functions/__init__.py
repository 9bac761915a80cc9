"""CasADi functions of a program: blocks, exact sparse derivatives."""
