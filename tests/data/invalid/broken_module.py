"""Not Python: the parser lets it pass, the compiler does not."""

return 3  # noqa: F706
