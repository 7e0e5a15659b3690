"""`SystemSpec` → a running system on rclpy.

Imports go one way through its rooms:

- `messages`: payloads ⇄ messages.
- `behaviours`: the functions of a file: imported, called, waited for, their errors logged.
- `health`: what is measured of behaviours, and reported.
- `nodes`: a node without its entities, and what behaviours see of it.
- `entities`: a file for each kind of entity.
- `control`: the system's name, and the services by which it is asked.

The modules of this folder use them all: `run` makes a `system`, whose nodes `start`, `restart` and
`stop`. Except for these, which lie below the rooms: `forked_children`, `logs`,
`reserved_methods`, `stop_request` and, above `behaviours`, `system_executor`.
"""
