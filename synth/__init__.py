"""Synthetic recordings of twisted string actuators, with exact truth."""
