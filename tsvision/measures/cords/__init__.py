"""Cords that bow or hang, of any make: measured along a curve, with no section assumed."""
