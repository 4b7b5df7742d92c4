"""What an effect is, and how the catalogue finds the effects."""
