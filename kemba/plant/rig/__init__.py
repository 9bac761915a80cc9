"""The paper's bench rigs: imposed motion, logs, and what is fitted to them."""
