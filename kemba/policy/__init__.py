"""Feedback around a plan: a hybrid linear model along it, gains, and a policy that plays them."""
