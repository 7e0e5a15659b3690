"""What is written beside the code is true: generated pages, hooks, and the schema's examples."""

import importlib.util
import json
import re
import subprocess
import sys
from pathlib import Path

import pytest
import yaml
from jsonschema import Draft202012Validator

import composer
from composer.cli import main as cli
from composer.schema import SCENARIO_SCHEMA_NAME, schema_path

ROOT = Path(composer.__file__).parents[1]
SCHEMA = json.loads(schema_path().read_text())


def generated():
    spec = importlib.util.spec_from_file_location('generate', ROOT / 'docs' / 'generate.py')
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module.generate()


def sections_of(text):
    return {
        re.sub('[`,]', '', line.lstrip('# ').lower()).replace(' ', '-')
        for line in text.splitlines()
        if re.match('#+ ', line)
    }


@pytest.mark.parametrize('name', ['reference.md', 'rules.md', 'testing_reference.md'])
def test_a_generated_page_is_current(name):
    current = (ROOT / 'docs' / name).read_text() == generated()[name]
    assert current, f"docs/{name} is not current: run 'make docs'"


def test_the_links_of_a_page_lead_to_its_sections():
    for text in generated().values():
        assert set(re.findall(r'\]\(#([^)]*)\)', text)) <= sections_of(text)


@pytest.mark.parametrize(
    ('page_name', 'schema'),
    [
        ('reference.md', SCHEMA),
        ('testing_reference.md', json.loads(schema_path(SCENARIO_SCHEMA_NAME).read_text())),
    ],
)
def test_every_key_has_its_row(page_name, schema):
    page = generated()[page_name]

    def keys(schema):
        if isinstance(schema, dict):
            yield from schema.get('properties', {})
            for name, value in schema.items():
                if name not in ('examples', 'defaultSnippets'):
                    yield from keys(value)
        elif isinstance(schema, list):
            for value in schema:
                yield from keys(value)

    assert [key for key in keys(schema) if f'| `{key}` |' not in page] == []


@pytest.mark.parametrize(
    ('where', 'example'),
    [
        *((None, example) for example in SCHEMA['examples']),
        *(
            (name, example)
            for name, definition in SCHEMA['$defs'].items()
            for example in (
                *definition.get('examples', ()),
                *(each['body'] for each in definition.get('defaultSnippets', ())),
            )
        ),
    ],
)
def test_an_example_of_the_schema_fits_it(where, example):
    schema = SCHEMA if where is None else SCHEMA | {'$ref': f'#/$defs/{where}'}
    if where is not None:
        schema = {'$ref': f'#/$defs/{where}', '$defs': SCHEMA['$defs']}
    Draft202012Validator(schema).validate(example)


def test_the_modeline_of_shipped_systems_names_the_schema():
    for path in (ROOT / 'configs').glob('*.yaml'):
        first = path.read_text().partition('\n')[0]
        match = re.fullmatch(r'# yaml-language-server: \$schema=(\S+)', first)
        assert match, path
        assert (path.parent / match[1]).resolve() == schema_path().resolve()


# Hooks


def test_the_hook_runs_a_command_that_there_is(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (hook,) = yaml.safe_load((ROOT / '.pre-commit-hooks.yaml').read_text())
    assert (hook['id'], hook['language'], hook['types']) == ('composer-check', 'python', ['yaml'])
    (tmp_path / 'rover.yaml').write_text('version: 1\nnodes: {1st: {}}\n')
    (tmp_path / 'compose.yaml').write_text('version: "3"\nservices: {}\n')
    words = hook['entry'].split()
    assert words[0] == 'composer'
    assert cli.run([*words[1:], 'compose.yaml', 'rover.yaml']) == 1
    out = capsys.readouterr().out
    assert out.count('error[') == 1
    assert out.startswith('rover.yaml:2:9: error[bad-name]: ')


def test_the_action_checks_what_its_inputs_say(tmp_path):
    action = yaml.safe_load((ROOT / 'action.yml').read_text())
    assert set(action['inputs']) == {'files', 'args'}
    assert action['runs']['using'] == 'composite'
    script = action['runs']['steps'][-1]['run']
    (tmp_path / 'composer-check' / 'bin').mkdir(parents=True)
    command = tmp_path / 'composer-check' / 'bin' / 'composer'
    command.write_text(f'#!/bin/sh\nexec {sys.executable} -m composer "$@"\n')
    command.chmod(0o755)
    (tmp_path / 'rover.yaml').write_text('version: 1\nnodes: {1st: {}}\n')
    result = subprocess.run(
        ['bash', '-e', '-c', script],
        cwd=tmp_path,
        env={
            'PYTHONPATH': str(ROOT),
            'PATH': '/usr/bin:/bin',
            'RUNNER_TEMP': str(tmp_path),
            'FILES': '*.yaml $(touch ran)',
            'ARGS': '--strict',
        },
        capture_output=True,
        text=True,
        timeout=200,
        check=False,
    )
    assert result.returncode == 1
    assert '::error file=rover.yaml,line=2,endLine=2,col=9,' in result.stdout
    assert not (tmp_path / 'ran').exists()


PAGES = ['README.md', *(f'docs/{path.name}' for path in sorted((ROOT / 'docs').glob('*.md')))]


@pytest.mark.parametrize('path', PAGES)
def test_the_commands_of_the_recipes_take_their_options(path):
    text = (ROOT / path).read_text()
    context = cli.cli.commands['check'].make_context
    for line in re.findall(r'^\s*(?:\$|-|- run:|entry:) composer check (.*)$', text, re.MULTILINE):
        context('check', line.split(), resilient_parsing=True)


@pytest.mark.parametrize('path', PAGES)
def test_the_links_of_a_page_lead_to_files_and_sections(path):
    for target in re.findall(r'\]\(([^)\s]+)\)', (ROOT / path).read_text()):
        if target.startswith('https://'):
            continue
        name, _, section = target.partition('#')
        page = (ROOT / path).parent / name if name else ROOT / path
        assert page.is_file(), target
        assert not section or section in sections_of(page.read_text()), target


def test_the_tree_of_contributing_has_every_room():
    tree = (ROOT / 'CONTRIBUTING.md').read_text().partition('```')[2].partition('```')[0]
    rooms = {
        path.parent.name
        for path in (ROOT / 'composer').rglob('__init__.py')
        if not {'rules', 'templates'} & set(path.relative_to(ROOT).parts[1:-2])
    }
    listed = {line.split()[0].rstrip('/') for line in tree.splitlines() if line.strip()}
    listed |= set(re.findall(r'(\w+)/ (?:reads|builds)', tree))
    assert rooms - listed == set()


@pytest.mark.parametrize('path', ['CONTRIBUTING.md', *PAGES])
def test_the_modules_and_pages_that_a_page_names_are_there(path):
    named = re.findall(r'`((?:\w+/)+\w+\.(?:py|md))`', (ROOT / path).read_text())
    folders = (ROOT, ROOT / 'composer', ROOT / 'configs')
    assert [name for name in named if not any((each / name).is_file() for each in folders)] == []


def test_the_first_page_leads_to_all_others():
    text = (ROOT / 'README.md').read_text()
    assert [page for page in PAGES if page != 'README.md' and f']({page}' not in text] == []
