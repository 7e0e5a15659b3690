"""What behaviours give and get: plain data ⇄ messages."""
