"""The processor time of calls, and how long callbacks wait for the interpreter."""
