"""What the frames of a recording teach together: how light, blur and shape place the edges."""
