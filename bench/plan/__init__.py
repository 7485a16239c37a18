"""What an experiment asks for: schedule, torque, workers."""
