"""What bench and robot logs have in common for identification: residuals, candidates, noise."""
