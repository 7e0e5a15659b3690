"""What callbacks do over time: noted while somebody traces, and written as a timeline."""
