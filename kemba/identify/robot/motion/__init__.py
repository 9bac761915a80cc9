"""Motion along a robot log: samples, contacts, a Kalman filter over them."""
