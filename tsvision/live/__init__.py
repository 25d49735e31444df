"""FRAMES AS THEY COME -> A DECISION: watching a camera while the motor turns.

`sources` give frames with their turns; `learning` gets to know the view; `believing` tells after
each measured frame how likely every phase is, and decides; `watching` is the loop over all three.
"""
