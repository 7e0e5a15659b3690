"""What Composer costs, beside what it stands in for: `make bench`.

`rows` is the table of what is promised, `measure` the list of what can be measured, one file a
subject. `run` measures each row's sides in turn, each in a process of its own (`processes`), and
`report` makes a table and a JSON file of it. To promise more, add a file, a subject and rows.
"""
