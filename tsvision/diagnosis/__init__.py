"""What the model gets wrong, why, and what extending it gains."""
