"""Logs of a life-cycle rig: what they hold, what is wrong in them, when the string broke."""
