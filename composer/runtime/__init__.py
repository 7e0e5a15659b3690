"""`SystemSpec` → a running system on rclpy.

Imports go one way through its rooms:

- `messages`: payloads ⇄ messages.
- `behaviours`: the functions of a file: imported, called, waited for, their errors logged.
- `health`: what is measured of behaviours, and told.
- `nodes`: a node without its entities, and what behaviours see of it.
- `entities`: a file for each kind of entity.

The modules of this folder use them all: `run` makes a `system`, whose nodes `start`, `restart` and
`stop`. Except for these: `forced_exit`, `forked_children`, `logs`, `reserved_methods` and `stop_request`
lie below the rooms, `system_executor` above `behaviours`.
"""
