"""Half-shaft stiffness from drawings and from tip-ins."""
