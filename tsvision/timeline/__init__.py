"""ROWS -> EVENTS: tracks, phases, onsets."""
