"""What a designer asks of an actuator: onset, limits, statics, candidates."""
