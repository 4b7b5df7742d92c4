"""What an effect is, and how the catalog finds the effects."""
