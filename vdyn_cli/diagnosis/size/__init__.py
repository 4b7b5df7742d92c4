"""How large a finding is, and whether it matters."""
