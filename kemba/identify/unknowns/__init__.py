"""What may differ from the model: effects that it lacks, sensor faults, nominal figures."""
