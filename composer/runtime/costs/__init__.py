"""What calls cost: processor time, and how long they keep the interpreter from the others."""
