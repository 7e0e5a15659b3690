"""What a scenario file says is compared with its system before anything runs."""

import pytest

pytestmark = pytest.mark.ros

RIGHT = [
    {'when': '{at: 1, publish: /scan, message: {ranges: [0.2]}}'},
    {'when': '{call: /reset, request: {data: true}, response: {success: true}, timeout: 2}'},
    {'when': '{call: /lab/robot/get_parameters, request: {names: [limit]}}'},
    {'when': '{call: /driver/change_state, request: {transition: {id: 1}}}'},
    {'when': '{call: /dock}', 'given': '{services: {/dock: {response: {success: true}}}}'},
    {'when': '{send_goal: /drive}', 'given': '{actions: {/drive: {}}}'},
    {'when': '{set_parameters: {robot: {limit: -1}}, refused: true}'},
    {'when': '{set_parameters: {/lab/robot: {limit: 2, mode: slow}}}'},
    {'given': '{services: {/dock: {response: {success: "{{ request.data }}", message: "{{ request.data }}!"}}}}'},
    {'given': '{actions: {/drive: {feedback: [{message: {partial_sequence: [0, "{{ goal.order }}"]}}]}}}'},
    {'then': '{topic: /speed, where: "message.linear.x == 0", within: [0, 10]}'},
    {'then': '{topic: /speed, message: {linear: {x: 1}}, count: [1, 2]}'},
    {'then': '{topic: /scan}', 'when': '{publish: /scan}'},
    {'then': '{topic: /lib, type: std_msgs/msg/String, where: data, count: 1}, {topic: /scan, type: sensor_msgs/msg/LaserScan}'},
    {'then': '{order: [{topic: /lib, type: std_msgs/msg/String, message: {data: x}}, {topic: /speed}]}'},
    *({'when': step, 'then': ''} for step in (
        '{call: /reset}', '{send_goal: /count}', '{set_parameters: {robot: {limit: 2}}}')),
    {'then': '{log: robot, level: error, never: true}, {log: "*", matches: "a+"}, {error: /lab/robot}'},
    {'then': '{parameters: {robot: {limit: 1}}}, {state: {driver: active}, at: 3}, {exit_code: 0}'},
]  # fmt: skip


@pytest.mark.parametrize('parts', RIGHT)
def test_what_fits_the_system_has_no_findings(check_case, parts):
    assert check_case(**parts) == []


WRONG = [
    # Topics, services and actions.
    ({'when': '{publish: /sacn}'},
     "/sacn unknown-topic: the system has no topic '/sacn' (did you mean '/scan'? Otherwise write "
     "its 'type' if it is none of the system's)"),
    ({'when': '{publish: /other, type: std_msgs/msg/String}'},
     "/other no-subscription: no node of this system subscribes to '/other'"),
    ({'when': '{publish: /speed}'},
     "/speed no-subscription: no node of this system subscribes to '/speed'"),
    ({'when': '{publish: /lab/robot/x, type: std_msgs/msg/Strong}'},
     "Strong unknown-type: the package 'std_msgs' has no message 'Strong' (did you mean 'String'?)",
     'no-subscription'),
    ({'when': '{call: /rest}'},
     "/rest unknown-service: the system has no service '/rest' (did you mean '/reset'?)"),
    ({'when': '{call: /dock}'}, "/dock no-server: no node of this system serves '/dock' "
     "(give it a stand-in, under 'given: {services: …}')"),
    ({'given': '{services: {/reset: {}}}'}, "/reset second-server: '/reset' is served by node "
     "'robot': a stand-in would be a second server (remove the stand-in)"),
    ({'then': '{topic: /sped}'},
     "/sped unknown-topic: the system has no topic '/sped' (did you mean '/speed'? "
     "Otherwise write its 'type' if a library publishes it with node.ros)"),
    ({'then': '{topic: /lib}'}, "/lib unknown-topic: the system has no topic '/lib' "
     "(write its 'type' if a library publishes it with node.ros)"),
    # Fields.
    ({'when': '{publish: /scan, message: {rangs: [1]}}'},
     "rangs unknown-field: sensor_msgs/msg/LaserScan has no field 'rangs' (did you mean 'ranges'? its fields are header, angle_min, angle_max, "
     "angle_increment, time_increment, scan_time, range_min, range_max, ranges, intensities)"),
    ({'when': '{publish: /scan, message: {ranges: near}}'},
     "near field-type: sensor_msgs/msg/LaserScan: ranges: expected float32[], got str 'near' (write it as a list)"),
    ({'when': '{call: /reset, response: {succes: true}}'},
     "succes unknown-field: std_srvs/srv/SetBool_Response has no field 'succes' "
     "(did you mean 'success'? its fields are success, message)"),
    ({'when': '{send_goal: /count, feedback: [{partial_sequenc: [0]}]}'},
     "partial_sequenc unknown-field: action_tutorials_interfaces/action/Fibonacci_Feedback has no field 'partial_sequenc' "
     "(did you mean 'partial_sequence'? its fields are partial_sequence)"),
    ({'given': '{services: {/dock: {response: {success: yes}}}}'},
     "yes field-type: std_srvs/srv/SetBool_Response: success: expected bool, got str 'yes' (write true or false)"),
    # Expressions.
    ({'then': '{topic: /speed, where: "linear.w > 0"}'},
     "w unknown-field: geometry_msgs/msg/Vector3 has no field 'w' (its fields are x, y, z)"),
    ({'then': '{topic: /speed, eventually: "linear.x >"}'},
     '"linear.x >" bad-expression: unexpected end of the expression'),
    ({'then': '{topic: /speed, where: "{{ linear.x }}"}'}, '"{{ linear.x }}" bad-expression: '
     'write it without braces (the whole text is the expression)'),
    ({'given': '{services: {/dock: {response: {message: "{{ requst.data }}"}}}}'},
     "requst undefined-name: 'requst' is not defined (did you mean 'request'?)"),
    # Nodes.
    ({'given': '{parameters: {robto: {limit: 1.0}}}'},
     "robto unknown-node: there is no node 'robto' in this system (did you mean 'robot'?)"),
    ({'given': '{parameters: {robot: {limt: 1.0}}}'},
     "limt unknown-parameter: node 'robot' declares no parameter 'limt' (did you mean 'limit'?)"),
    ({'given': '{parameters: {robot: {limit: -1}}}'},
     "-1 refused-parameter: parameter 'limit': -1.0 is below the minimum 0.0"),
    ({'then': '{parameters: {/robot: {limit: 1}}}'},
     "/robot unknown-node: there is no node '/robot' in this system (did you mean '/lab/robot'?)"),
    ({'then': '{log: robt}'},
     "robt unknown-node: there is no node 'robt' in this system (did you mean 'robot'?)"),
    ({'then': '{log: robot, never: "x > 1"}'},
     '"x > 1" wrong-type: expected \'never: true\': an expression knows no lines of a log '
     "(write what the lines have in them, under 'text')"),
    ({'then': '{log: robot, matches: "("}'}, '"(" bad-value: this is no regular expression: '
     'missing ), unterminated subpattern at position 0'),
    # What holds whatever happens.
    *(({**given, 'then': ''}, "[ nothing-expected: this case expects nothing, and passes whatever "
       "happens (write what it shows, or {error: '*', never: true})")
      for given in ({}, {'when': '{publish: /scan}'}, {'given': '{services: {/dock: {}}}'})),
    ({'then': '{topic: /speed, never: "false"}'},
     '"false" nothing-expected: this is the same for every message (name a field)'),
    ({'then': '{parameters: {}}'}, '{ out-of-range: expected at least 1 key, got an empty mapping'),
    ({'when': '{send_goal: /count, feedback: []}'}, '[ out-of-range: expected at least 1 item, got an empty list'),
    # Times.
    ({'when': '{at: 10.1, publish: /scan}'}, '10.1 after-the-end: 10.1 s is after the end of the '
     "case, which is at 10 s (let the case last longer, with 'until')"),
    ({'when': '{at: 5, every: 1, times: 7, publish: /scan}'}, '7 after-the-end: the last of 7 is at '
     '11 s, and the case ends at 10 s (6 fit; without times, it goes on to the end)'),
    ({'then': '{topic: /speed, within: [11, 12]}'}, '12 after-the-end: 12 s is after the end of the '
     "case, which is at 10 s (let the case last longer, with 'until')"),
    ({'then': '{topic: /speed, count: [3, 1]}'},
     '[ bad-value: 3 is more than 1: the lower one comes first (did you mean [1, 3]?)'),
    ({'then': '{parameters: {robot: {limit: 1}}, at: 11}'}, '11 after-the-end: 11 s is after the end '
     "of the case, which is at 10 s (let the case last longer, with 'until')"),
]  # fmt: skip


@pytest.mark.parametrize('wrong', WRONG, ids=lambda wrong: str(wrong[0]))
def test_what_does_not_fit_is_found_at_its_place(check_case, wrong):
    parts, finding, *others = wrong
    found = check_case(**parts)
    assert finding in found
    assert [each.split(':')[0].split()[-1] for each in found if each != finding] == others


def test_the_errors_of_the_system_are_told(check, project):
    (project / 'robot.yaml').write_text('version: 1\nnodes:\n  robot:\n    timrs: {}\n')
    found = check(
        'version: 1\nsystem: {file: robot.yaml}\ncases: {one: {then: [{exit_code: 0}], until: 1}}\n'
    )
    assert [(each.file, each.rule) for each in found] == [('robot.yaml', 'unknown-key')]


# Processes whose programs and files are elsewhere, and one that is wrong anywhere.
PROCESSES = {
    '{package: rviz3, executable: rviz3}': [],
    '{command: [sleep, "1"], cwd: "package://rviz3/x"}': [],
    '{launch: rviz3/launch/all.launch.py}': [],
    '{package: rviz3, executable: rviz3, parameter_files: [package://rviz3/x.yaml]}': [],
    '{command: [sleep, "1"], nmae: x}': ['unknown-key'],
}


@pytest.mark.parametrize(('process', 'rules'), PROCESSES.items())
def test_processes_need_no_programs_in_tests(check, project, process, rules):
    system = f'version: 1\nnodes: {{robot: {{}}}}\nprocesses:\n  viewer: {process}\n'
    (project / 'robot.yaml').write_text(system)
    found = check(
        'version: 1\nsystem: {file: robot.yaml}\ncases: {one: {then: [{exit_code: 0}], until: 1}}\n'
    )
    assert [each.rule for each in found] == rules


def test_a_comment_silences_a_rule_in_its_line(check):
    text = """\
        version: 1
        system: {file: robot.yaml}
        cases:
          one:
            until: 1
            then:
              - {topic: /scan}  # composer: ignore[no-publisher]
              - {topic: /speed}  # composer: ignore[no-publisher]
    """
    assert [(each.span.line, each.rule) for each in check(text)] == [(8, 'unused-ignore')]


def test_a_recording_that_is_not_there_is_found(check_case):
    found = check_case(given='{recording: run.mcap}', then='{topic: /speed, like: no.mcap}')
    assert [each.split(' (')[0] for each in found] == [
        "run.mcap unreadable-file: there is no file 'run.mcap'",
        "no.mcap unreadable-file: there is no file 'no.mcap'",
    ]


def test_a_file_that_is_no_recording_is_found(check_case):
    (found,) = check_case(then='{topic: /speed, like: robot.yaml}')
    assert found.startswith('robot.yaml unreadable-file: ')
