"""Robot logs as a problem of identification: measured motion, read contacts, filtered defects."""
