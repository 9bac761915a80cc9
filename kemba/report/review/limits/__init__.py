"""How much of what the robot can do was used: torque, friction, energy, air."""
