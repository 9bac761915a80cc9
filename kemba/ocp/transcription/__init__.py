"""A task on a model as rows of a nonlinear program on a time grid."""
