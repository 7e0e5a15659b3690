'use strict';
// Everything shown comes from the data of the page, and is set as text, never as markup.
const byId = (id) => document.getElementById(id);
const stage = byId('stage');
const search = byId('search');
const isolation = byId('isolation');
const MOST_MATCHES = 200;
const MOST_PROBLEMS = 400;
const MOST_LINES = 300;
const MOST_POINTS = 60;
const SAMPLE_MS = 1000;

// What is shown: the drawing with its parts by token, and the latest state.
let svg = document.createElementNS('http://www.w3.org/2000/svg', 'svg');
let parts = new Map();
// What is drawn for parts that are in a folded box, by their tokens.
let standsIn = {};
const folded = new Set();
// The connections that begin or end at a part, with their other ends.
const flows = {down: new Map(), up: new Map()};
let findings = [];
let state = {};
// How far the clock of the browser is ahead of the page's, in seconds.
let ahead = 0;
let drawn = 0;
const tokens = new Map();
const rates = new Map();

// The view: a rectangle of the drawing, moved and resized by its viewBox.
let all = {x: 0, y: 0, width: 1, height: 1};
let view = {...all};
// Whether it is that of the whole drawing, as before somebody moves or resizes it.
let showsAll = true;

function show(next, isAll = false) {
  view = next;
  showsAll = isAll;
  svg.setAttribute('viewBox', `${view.x} ${view.y} ${view.width} ${view.height}`);
}

// Returns the least rectangle of the stage's proportions around another one.
function shaped(box) {
  const stretch = stage.clientWidth / Math.max(stage.clientHeight, 1);
  const width = Math.max(box.width, box.height * stretch);
  const height = width / stretch;
  return {
    x: box.x - (width - box.width) / 2, y: box.y - (height - box.height) / 2, width, height,
  };
}

function fit() {
  const margin = all.width * 0.02;
  show(shaped({
    x: all.x - margin, y: all.y - margin, width: all.width + 2 * margin,
    height: all.height + 2 * margin,
  }), true);
}

// Zooms around a point, given in parts of the stage's width and height.
function zoom(factor, across = 0.5, down = 0.5) {
  const width = Math.min(Math.max(view.width * factor, 40), all.width * 20 + 2000);
  const height = width * view.height / view.width;
  show({
    x: view.x + (view.width - width) * across, y: view.y + (view.height - height) * down,
    width, height,
  });
}

function move(across, down) {
  show({...view, x: view.x + view.width * across, y: view.y + view.height * down});
}

// Moves a part of the drawing to the middle, large enough to read.
function bringIn(element) {
  const seen = element.getBoundingClientRect();
  const frame = stage.getBoundingClientRect();
  const scale = view.width / Math.max(frame.width, 1);
  const x = view.x + (seen.left + seen.width / 2 - frame.left) * scale;
  const y = view.y + (seen.top + seen.height / 2 - frame.top) * scale;
  const width = Math.min(view.width, Math.max(frame.width * 0.9, seen.width * scale * 1.2));
  const height = width * view.height / view.width;
  show({x: x - width / 2, y: y - height / 2, width, height});
}

function isInView(element) {
  const seen = element.getBoundingClientRect();
  const frame = stage.getBoundingClientRect();
  return seen.left >= frame.left && seen.right <= frame.right
    && seen.top >= frame.top && seen.bottom <= frame.bottom;
}

// The panel.
// Characters that cannot be seen, or that turn the text around them, become escapes.
const UNSEEN = /[\0-\x08\x0b-\x1f\x7f-\x9f\xad\u061c\u200b\u200e\u200f\u2028-\u202e\u2060-\u2069\ufeff\ufff9-\ufffb]|\p{Surrogate}/gu;
const clean = (text) => String(text).replace(UNSEEN, (each) => `\\u${each.charCodeAt(0).toString(16).padStart(4, '0')}`);

function make(tag, text = '', className = '') {
  const element = document.createElement(tag);
  element.textContent = clean(text);
  if (className) element.className = className;
  // What scrolls is scrolled with the keyboard, too.
  if (tag === 'pre') element.tabIndex = 0;
  return element;
}

function makeButton(text, press) {
  const button = make('button', text);
  button.type = 'button';
  button.addEventListener('click', press);
  return button;
}

function makeLink(token, text) {
  const button = makeButton(text, () => choose(token, true));
  button.dataset.token = token;
  const item = make('li');
  item.append(button);
  return item;
}

// A place in a file; it opens the editor, where there is one.
function makePlace(file, line) {
  const text = line ? `${file}:${line}` : file;
  if (!state.editor || !file || file.startsWith('--')) return document.createTextNode(clean(text));
  const path = file.startsWith('/') ? file : `${state.folder}/${file}`;
  const link = make('a', text);
  link.href = state.editor.replace('{file}', encodeURI(path)).replace('{line}', line ?? 1);
  return link;
}

function makeExcerpt(excerpt) {
  const block = document.createDocumentFragment();
  const place = make('p', excerpt.what ? `${excerpt.what}: ` : '', 'place');
  place.append(makePlace(excerpt.file, excerpt.first));
  block.append(place);
  const text = make('pre');
  const width = String(excerpt.first + excerpt.lines.length - 1).length;
  excerpt.lines.forEach((line, index) => {
    text.append(make('span', `${String(excerpt.first + index).padStart(width)}  `, 'number'));
    text.append(`${clean(line)}\n`);
  });
  block.append(text);
  return block;
}

function makeFinding(finding) {
  const text = make('p', '', finding.severity);
  text.append(make('b', finding.severity), clean(` ${finding.rule}: ${finding.message}`));
  if (finding.help) text.append(make('br'), make('span', `help: ${finding.help}`, 'kind'));
  return text;
}

function describe(token) {
  const part = parts.get(token);
  const details = byId('details');
  details.replaceChildren();
  if (!part) return;
  const heading = make('h2', part.name);
  heading.append(' ', make('span', part.kind, 'kind'));
  details.append(heading);
  for (const fact of part.facts) details.append(make('p', fact));
  for (const index of part.findings) details.append(makeFinding(findings[index]));
  for (const excerpt of part.excerpts) details.append(makeExcerpt(excerpt));
  if (part.members) {
    const button = makeButton(part.folded ? 'Unfold' : 'Fold', () => fold(part));
    const inside = make('details');
    inside.append(make('summary', `In it (${part.members.length})`), makeLinks(part.members.map(
      (each) => [each, `${parts.get(each).kind} ${parts.get(each).name}`],
    )));
    details.append(button, inside);
  }
  // From a node past its publisher, say, to the topic.
  const within = new Set([token, ...part.members ?? []]);
  const ends = part.near.map((near) => {
    const far = near[0] === 'e' && token[0] !== 'm'
      ? parts.get(near).near.find((each) => !within.has(each)) : near;
    return [far, `${parts.get(near).kind} ${parts.get(far).name}`];
  });
  if (ends.length) details.append(make('h2', 'Connected'), makeLinks(ends));
}

function makeLinks(ends) {
  const list = make('ul');
  for (const [text, token] of new Map(ends.map(([token, text]) => [text, token]))) {
    list.append(makeLink(token, text));
  }
  return list;
}

// What is made anew keeps the focus: on the same part, box or problem.
function replace(list, items) {
  const nameOf = (element) => [element.dataset.token, element.parentElement.dataset.space].join();
  const focused = list.contains(document.activeElement) ? nameOf(document.activeElement) : null;
  list.replaceChildren(...items);
  if (focused === null) return;
  [...list.querySelectorAll('button, summary')].find((each) => nameOf(each) === focused)?.focus();
}

// Selection, by pointer, keyboard, list or address.
const shapeOf = (token) => byId(standsIn[token] ?? token);
let chosen = null;
// The id of what a new address asks for, until it or something else is selected.
let wished;

// Gives a class to what is drawn for these parts, and to nothing else.
function paint(name, tokens) {
  for (const element of svg.querySelectorAll(`.${name}`)) element.classList.remove(name);
  for (const token of tokens) shapeOf(token)?.classList.add(name);
}

// Returns what is up- or downstream of a part, with the connections on the way.
function reach(token) {
  const part = parts.get(token);
  const mode = isolation.value;
  const found = new Set([token]);
  const starts = part.members ?? (token[0] === 'm' ? part.near.flatMap((each) => [...ends(each)])
    : token[0] === 'e' ? part.near : [token]);
  for (const way of mode === 'near' || mode === 'both' ? ['up', 'down'] : [mode]) {
    const seen = new Set(token[0] === 'm' ? part.near.map((each) => ends(each)[way === 'up' ? 0 : 1])
      : token[0] === 'e' ? [ends(token)[way === 'up' ? 0 : 1]] : starts);
    for (const end of seen) {
      found.add(end);
      // The neighbours of a node are behind its topics.
      if (mode === 'near' && end[0] === 'n' && !starts.includes(end)) continue;
      for (const [edge, far] of flows[way].get(end) ?? []) found.add(edge) && seen.add(far);
    }
  }
  for (const each of token[0] === 'm' ? part.near : starts) found.add(each);
  return found;
}

// Returns where messages, calls or goals of a connection begin, and where they end.
const ends = (token) => parts.get(token).near;

function isolate() {
  const isolated = chosen !== null && isolation.value !== 'off';
  svg.classList.toggle('choosing', isolated);
  const found = isolated ? [...reach(chosen)] : [];
  // The ends outside belong to their topics.
  paint('near', [...found, ...found.flatMap((each) => parts.get(each).outside ?? [])]);
}

// The address has all of the view: the selection first.
function remember() {
  const view = new URLSearchParams();
  for (const id of folded) view.append('fold', id);
  if (search.value) view.set('search', search.value);
  if (isolation.value !== 'both') view.set('isolate', isolation.value);
  const texts = [encodeURIComponent(parts.get(chosen)?.id ?? ''), view.toString()];
  const hash = texts.filter((each, index) => each || (index === 0 && texts[1])).join('&');
  history.replaceState(null, '', hash ? `#${hash}` : location.pathname);
}

// Returns the id of what is selected in an address, and sets the rest of the view from it.
function restore({hash} = location) {
  const [id, ...rest] = hash.slice(1).split('&');
  const view = new URLSearchParams(rest.join('&'));
  folded.clear();
  for (const each of view.getAll('fold')) folded.add(each);
  search.value = view.get('search') ?? '';
  isolation.value = view.get('isolate') ?? 'both';
  if (!isolation.value) isolation.value = 'both';
  try { return decodeURIComponent(id); } catch { return ''; }
}

function fold(part) {
  if (!folded.delete(part.id)) folded.add(part.id);
  chosen = tokens.get(part.id) ?? chosen;
  wished = undefined;
  return draw();
}

function foldAll() {
  const ids = [...parts.values()].filter((part) => part.members).map((part) => part.id);
  if (folded.size) folded.clear();
  else for (const id of ids) folded.add(id);
  draw();
}

// A box folds or unfolds; all else is selected.
function press(token) {
  const part = parts.get(token);
  if (part?.members) fold(part);
  else choose(token, false);
}

function choose(token, mustBeSeen) {
  chosen = parts.has(token) ? token : null;
  wished = undefined;
  remember();
  const hadFocus = byId('details').contains(document.activeElement);
  describe(chosen);
  // Its links are others now: the keyboard goes on from the top of the selection.
  if (hadFocus) document.querySelector('aside').focus();
  showLive();
  askParameters();
  offerMessage();
  offerActs();
  showLog();
  // A topic may be several lines.
  const lines = parts.get(chosen)?.kind === 'topic' && shapeOf(chosen)?.matches('.edge');
  paint('chosen', chosen === null ? [] : [chosen, ...lines ? parts.get(chosen).near : []]);
  isolate();
  if (chosen !== null && mustBeSeen) bringIn(shapeOf(token));
}

function makeSelectable(token, part) {
  const element = byId(token);
  if (!element) return;
  element.classList.add('known');
  if (part.kind === 'node') element.dataset.id = part.id;
  if (part.members) {
    element.querySelector('text').prepend(part.folded ? '▸ ' : '▾ ');
    element.setAttribute('aria-expanded', String(!part.folded));
  }
  if (element.matches('.edge')) {
    const reach = element.querySelector('path').cloneNode();
    reach.setAttribute('class', 'reach');
    element.append(reach);
  }
  if (!'em'.includes(token[0])) {
    element.setAttribute('tabindex', '0');
    element.setAttribute('role', 'button');
    element.setAttribute('aria-label', `${part.kind} ${part.name}`);
    element.addEventListener('focus', () => { if (!isInView(element)) bringIn(element); });
  }
  element.addEventListener('keydown', (event) => {
    if (event.key !== 'Enter' && event.key !== ' ') return;
    event.preventDefault();
    press(token);
  });
}

// The pointer: drag to move, click to select, turn the wheel to zoom.
let drag = null;
stage.addEventListener('pointerdown', (event) => {
  if (event.button !== 0) return;
  // The view may move below the pointer before it is lifted.
  const part = parts.get(event.target.closest('.known')?.id)?.id;
  drag = {x: event.clientX, y: event.clientY, view, moved: false, part};
});
stage.addEventListener('pointermove', (event) => {
  if (!drag) return;
  const across = event.clientX - drag.x;
  const down = event.clientY - drag.y;
  if (!drag.moved && Math.hypot(across, down) < 4) return;
  if (!drag.moved) stage.setPointerCapture(event.pointerId);
  drag.moved = true;
  const scale = drag.view.width / Math.max(stage.clientWidth, 1);
  show({...drag.view, x: drag.view.x - across * scale, y: drag.view.y - down * scale});
});
stage.addEventListener('pointerup', () => {
  if (drag && !drag.moved) press(tokens.get(drag.part));
  drag = null;
});
stage.addEventListener('pointercancel', () => { drag = null; });
stage.addEventListener('wheel', (event) => {
  event.preventDefault();
  const frame = stage.getBoundingClientRect();
  const steps = event.deltaY * (event.deltaMode === 1 ? 30 : 1);
  zoom(
    1.002 ** Math.max(-300, Math.min(300, steps)),
    (event.clientX - frame.left) / frame.width, (event.clientY - frame.top) / frame.height,
  );
}, {passive: false});

const KEYS = {
  ArrowLeft: () => move(-0.1, 0), ArrowRight: () => move(0.1, 0),
  ArrowUp: () => move(0, -0.1), ArrowDown: () => move(0, 0.1),
  '+': () => zoom(0.8), '=': () => zoom(0.8), '-': () => zoom(1.25), 0: fit, f: foldAll,
};
stage.addEventListener('keydown', (event) => {
  if (!(event.key in KEYS) || event.ctrlKey || event.metaKey || event.altKey) return;
  event.preventDefault();
  KEYS[event.key]();
});
document.addEventListener('keydown', (event) => {
  if (event.key === '/' && document.activeElement !== search) {
    event.preventDefault();
    search.focus();
  } else if (event.key === 'Escape') {
    search.value = '';
    find();
    choose(null, false);
  }
});
byId('zoom-in').addEventListener('click', () => zoom(0.8));
byId('zoom-out').addEventListener('click', () => zoom(1.25));
byId('fit').addEventListener('click', fit);
byId('fold-all').addEventListener('click', foldAll);
isolation.addEventListener('change', () => { isolate(); remember(); });

// The search: each word must be in the kind, the name or the facts.
function find() {
  const words = search.value.toLowerCase().split(/\s+/).filter(Boolean);
  const matching = [];
  for (const [token, part] of parts) {
    const text = [part.kind, part.name, ...part.facts].join('\n').toLowerCase();
    if (words.length && words.every((word) => text.includes(word))) matching.push(token);
  }
  paint('match', matching);
  const found = matching.filter((token) => !'em'.includes(token[0]));
  svg.classList.toggle('searching', words.length > 0);
  byId('count').textContent = words.length ? `${found.length} found` : '';
  byId('found').hidden = words.length === 0;
  replace(byId('matches'), found.slice(0, MOST_MATCHES).map(
    (token) => makeLink(token, `${parts.get(token).kind} ${parts.get(token).name}`),
  ));
  return found;
}
search.addEventListener('input', () => { find(); remember(); });
search.addEventListener('keydown', (event) => {
  if (event.key !== 'Enter') return;
  // Enter goes from one match to the next.
  const found = find();
  if (found.length) choose(found[(found.indexOf(chosen) + 1) % found.length], true);
});

// The drawing, anew when the plan has changed; the selection stays.
async function get(path) {
  const answer = await fetch(path, {headers: {accept: 'application/json'}});
  return answer.json();
}

let asked = 0;

async function draw(wanted) {
  const turn = ++asked;
  const before = chosen;
  wished = wanted ?? wished;
  let selected = wished ?? parts.get(chosen)?.id ?? restore();
  // Of many nodes, the first drawing folds those of a namespace.
  const isFirst = !parts.size && !folded.size;
  const words = isFirst ? '' : ['', ...folded].map((id) => `folded=${encodeURIComponent(id)}`).join('&');
  const drawing = await get(`api/drawing?${words}`);
  // Who folds two boxes in a row sees the second drawing.
  if (turn !== asked) return;
  // Who selects something else meanwhile keeps it.
  if (chosen !== before) selected = parts.get(chosen)?.id;
  const hasFocus = svg.contains(document.activeElement);
  parts = new Map(Object.entries(drawing.parts ?? {}));
  if (isFirst) for (const part of parts.values()) if (part.folded) folded.add(part.id);
  findings = drawing.findings ?? [];
  tokens.clear();
  standsIn = drawing.stands_in ?? {};
  for (const way of Object.values(flows)) way.clear();
  for (const [token, part] of parts) {
    tokens.set(part.id, token);
    if (token[0] !== 'e') continue;
    const [start, end] = ends(token);
    flows.down.set(start, [...flows.down.get(start) ?? [], [token, end]]);
    flows.up.set(end, [...flows.up.get(end) ?? [], [token, start]]);
  }
  if (drawing.svg) {
    const made = new DOMParser().parseFromString(drawing.svg, 'image/svg+xml').documentElement;
    const box = made.viewBox.baseVal;
    all = {x: box.x, y: box.y, width: box.width, height: box.height};
    svg = document.importNode(made, true);
    stage.replaceChildren(svg);
    if (showsAll) fit(); else show(view);
  } else {
    stage.replaceChildren(make('p', state.drawing_problem || 'There is no drawing.', 'kind'));
  }
  for (const [token, part] of parts) makeSelectable(token, part);
  find();
  showTree();
  // Until there is a drawing, the address keeps what is wanted.
  if (parts.size) choose(tokens.get(selected), false);
  if (hasFocus) shapeOf(chosen)?.focus();
  mark();
  stampParts();
}

// The state.
const LEVELS = ['ok', 'warn', 'stale', 'error'];
const worse = (one, other) => (LEVELS.indexOf(one) > LEVELS.indexOf(other) ? one : other);
const keyOf = (row) => `${row.kind}:${row.node}:${row.name}`;
const rows = () => state.health?.entities ?? [];

function levelOf(row) {
  const level = row.level ?? 'ok';
  return row.errors > 0 || row.dropped > 0 ? worse(level, 'warn') : level;
}

function levelsOfNodes() {
  const levels = new Map();
  for (const {level, node} of state.problems ?? []) levels.set(node, worse(level, levels.get(node) ?? 'ok'));
  return levels;
}

// What is older than two of its periods is shown as old: each element that says when what it
// shows was heard, by the clock of the page, and how often it is.
function stamp(element, heard, period = 1) {
  if (heard === undefined) delete element.dataset.heard;
  else Object.assign(element.dataset, {heard, period: Math.max(period, 0.5)});
  showAge(element);
}

function showAge(element) {
  const {heard, period} = element.dataset;
  const age = Date.now() / 1000 - ahead - heard;
  const isOld = age > 2 * period;
  if (!isOld && !element.classList.contains('old')) return;
  element.classList.toggle('old', isOld);
  if (isOld && heard > 0) element.dataset.age = `heard ${age.toFixed(0)} s ago`;
  else delete element.dataset.age;
}

function showAges() {
  for (const element of document.querySelectorAll('[data-heard]')) showAge(element);
}

// A node, wherever it is shown, and what is drawn of ends and boxes, are as old as their oldest row.
function stampParts() {
  const oldest = new Map();
  for (const row of rows()) {
    for (const id of [`node:${row.node}`, keyOf(row)]) {
      oldest.set(id, Math.min(oldest.get(id) ?? Infinity, row.heard));
    }
  }
  // A file that does not run is as new as it gets, and a system that has gone is old.
  const rest = state.status?.heard ?? (state.problem === undefined ? undefined : 0);
  const period = state.health?.period_sec;
  const put = (element, heard) => (heard === undefined
    ? stamp(element, rest, state.status?.period_sec) : stamp(element, heard, period));
  for (const element of document.querySelectorAll('[data-id]')) put(element, oldest.get(element.dataset.id));
  for (const [token, part] of parts) {
    const element = byId(token);
    if (!element || element.dataset.id) continue;
    const near = [...part.near, ...part.members ?? []].map((each) => oldest.get(parts.get(each)?.id))
      .filter((each) => each !== undefined);
    put(element, oldest.get(part.id) ?? (near.length ? Math.min(...near) : undefined));
  }
}

// Shows the levels in the drawing: classes alone, the layout stays.
function mark() {
  const levels = levelsOfNodes();
  const runs = new Set(state.status?.nodes ?? []);
  const tokensOf = (test) => [...levels].filter(test).map(([name]) => tokens.get(`node:${name}`));
  const drops = rows().filter((row) => levelOf(row) !== 'ok').map((row) => tokens.get(keyOf(row)));
  const nodes = [...parts].filter(([token, part]) => part.kind === 'node' && !standsIn[token]);
  paint('hurts', [...tokensOf(([, level]) => level === 'error'), ...drops.filter((each) => shapeOf(each)?.matches('.edge'))]);
  paint('warns', tokensOf(([, level]) => level === 'warn' || level === 'stale'));
  paint('absent', nodes.filter(([, part]) => state.runs === true && !runs.has(part.id.slice(5)))
    .map(([token]) => token));
  for (const [token, part] of parts) if (token[0] === 'm') addUp(token, part);
}

// A line that stands for several shows how much goes over all of them.
function addUp(token, part) {
  const texts = byId(token).querySelectorAll('text');
  part.facts.forEach((fact, index) => {
    const ids = new Set(part.near.map((each) => parts.get(each))
      .filter((each) => fact.includes(each.kind)).map((each) => each.id));
    const crossing = rows().filter((row) => ids.has(keyOf(row)));
    const rate = crossing.reduce((sum, row) => sum + (row.rate_hz ?? 0), 0);
    if (texts[index]) texts[index].textContent = crossing.length ? `${fact}, ${number(rate)} Hz` : fact;
  });
}

// Items stay as they are while they are about the same: who is about to click, or has the focus,
// keeps them. Only what they say changes.
function showItems(list, items) {
  const keys = JSON.stringify(items.map(({level, part}) => [level, part, tokens.get(part)]));
  if (list.dataset.keys !== keys) {
    list.dataset.keys = keys;
    replace(list, items.map(({level, part}) => {
      const token = tokens.get(part);
      const item = token ? makeLink(token, '') : make('li');
      const line = make('span', '', level);
      line.append(make('b', level), ' ', make('span'));
      (item.firstChild ?? item).append(line);
      if (part) item.dataset.id = part;
      return item;
    }));
  }
  items.forEach(({text: said}, index) => {
    const text = clean(said);
    const place = list.children[index].querySelector('b + span');
    if (place.textContent !== text) place.textContent = text;
  });
}

function showProblems() {
  const items = (state.problems ?? []).map(({level, text, node}) => ({level, text, part: `node:${node}`}));
  if (state.problem) items.unshift({level: 'error', text: state.problem, part: ''});
  if (state.drawing_problem) items.push({level: 'warn', text: state.drawing_problem, part: ''});
  for (const finding of findings) {
    const place = finding.line ? `${finding.file}:${finding.line}` : finding.file;
    const part = parts.get(finding.part)?.id ?? '';
    items.push({level: finding.severity, text: `${finding.message} (${place})`, part});
  }
  byId('none').hidden = items.length > 0;
  showItems(byId('problems'), items.slice(0, MOST_PROBLEMS));
}

function showTree() {
  const levels = levelsOfNodes();
  const {nodes: running, lifecycles, stopped} = state.status ?? {};
  const shown = JSON.stringify([drawn, [...levels].sort(), running, lifecycles, stopped, parts.size, state.outside]);
  if (byId('tree').dataset.shown === shown) return;
  byId('tree').dataset.shown = shown;
  const drawnNodes = [...parts.values()].filter((part) => part.id.startsWith('node:'))
    .map((part) => part.id.slice(5));
  const nodes = new Set([...drawnNodes, ...(state.status?.nodes ?? [])]);
  const groups = new Map();
  for (const node of [...nodes].sort()) {
    const space = node.slice(0, node.lastIndexOf('/')) || '/';
    groups.set(space, [...(groups.get(space) ?? []), node]);
  }
  const open = new Set([...document.querySelectorAll('#tree details:not([open])')]
    .map((each) => each.dataset.space));
  replace(byId('tree'), [...[...groups].map(([space, members]) => {
    const fold = make('details');
    fold.dataset.space = space;
    fold.open = !open.has(space);
    const worst = members.reduce((level, each) => worse(levels.get(each) ?? 'ok', level), 'ok');
    fold.append(make('summary', `${space} (${members.length})`, worst));
    const list = make('ul');
    for (const node of members) {
      const lifecycle = state.status?.stopped?.includes(node) ? 'stopped' : state.status?.lifecycles?.[node];
      const text = node.slice(node.lastIndexOf('/') + 1) + (lifecycle ? ` (${lifecycle})` : '');
      const token = tokens.get(`node:${node}`);
      const item = token ? makeLink(token, text) : make('li', text);
      item.classList.add(levels.get(node) ?? 'ok');
      item.dataset.id = `node:${node}`;
      list.append(item);
    }
    fold.append(list);
    const item = make('li');
    item.append(fold);
    return item;
  }), ...listOutside()]);
}

// The publishers and subscriptions of other programs, each a link to its topic.
function listOutside(only) {
  const ends = Object.entries(state.outside ?? {}).filter(([topic]) => (only ?? topic) === topic)
    .flatMap(([topic, found]) => found.map((end) => [topic, end]));
  if (!ends.length) return [];
  const list = make('ul');
  for (const [topic, end] of ends) {
    const text = `${end.kind}${only ? '' : ` ${topic}`} of ${end.node}`;
    const token = tokens.get(`topic:${topic}`);
    list.append(token && !only ? makeLink(token, text) : make('li', text));
  }
  const item = make(only ? 'div' : 'li', '', 'outside');
  item.append(make(only ? 'h2' : 'b', 'Outside the system'), list);
  return [item];
}

const clock = (sec = Date.now() / 1000) => new Date(sec * 1000).toTimeString().slice(0, 8);
const number = (value, digits = 1) => (typeof value === 'number' ? value.toFixed(digits) : '–');

function sparkline(points) {
  const line = document.createElementNS('http://www.w3.org/2000/svg', 'svg');
  const most = Math.max(...points, 1e-9);
  const path = document.createElementNS('http://www.w3.org/2000/svg', 'path');
  path.setAttribute('d', points.map((each, index) => (
    `${index ? 'L' : 'M'}${index * 60 / MOST_POINTS} ${15 - 14 * each / most}`)).join(''));
  line.setAttribute('viewBox', '0 0 60 16');
  line.setAttribute('class', 'spark');
  line.setAttribute('aria-hidden', 'true');
  line.append(path);
  return line;
}

// The entities of the chosen node, topic or end, with their figures.
function chosenRows() {
  const part = parts.get(chosen);
  if (!part) return [];
  if (part.id.startsWith('node:')) return rows().filter((row) => `node:${row.node}` === part.id);
  const ids = new Set([part.id, ...part.near.map((token) => parts.get(token)?.id)]);
  return rows().filter((row) => ids.has(keyOf(row)));
}

function showLive() {
  const found = chosenRows();
  const live = byId('live');
  const part = parts.get(chosen);
  const outside = part?.kind === 'topic' ? listOutside(part.id.slice(6)) : [];
  if (!found.length) { live.replaceChildren(...outside); return; }
  const table = make('table');
  const titles = ['Hz', '', 'p50', 'p99', 'core %', 'queue', 'drops', 'late', 'errors'];
  const header = make('tr');
  for (const title of titles) header.append(make('th', title));
  table.append(header);
  const isSum = 'gm'.includes(chosen[0]);
  for (const row of isSum ? [sumOf(found), ...found] : found) {
    const {period_sec: period} = state.health;
    // Names are long: each has a line of its own, above its figures.
    const about = make('tr', '', levelOf(row));
    const line = make('tr');
    const name = make('td', `${row.kind} ${row.name}`);
    name.colSpan = titles.length;
    about.append(name);
    const onTheWay = typeof row.delivery_p50_ms === 'number'
      && `${number(row.delivery_p50_ms, 2)} ms on the way, p99 ${number(row.delivery_p99_ms, 2)} ms`;
    const way = [row.delivery, row.delivery_reason, onTheWay].filter(Boolean).join(', ');
    if (way) name.append(make('br'), make('span', way, 'kind'));
    if (levelOf(row) !== 'ok' && row.message) name.append(make('br'), make('span', row.message));
    const spark = make('td');
    spark.append(sparkline(rates.get(keyOf(row)) ?? []));
    line.append(make('td', number(row.rate_hz)), spark);
    const cells = [number(row.p50_ms, 2), number(row.p99_ms, 2),
      row.cpu === null ? '–' : number(100 * row.cpu), number(row.queued, 0), number(row.dropped, 0),
      number(row.late, 0), number(row.errors, 0)];
    for (const cell of cells) line.append(make('td', cell));
    for (const each of [name, line]) stamp(each, row.heard, period);
    table.append(about, line);
  }
  live.replaceChildren(make('h2', isSum ? 'Now, across the border' : 'Now, p50 and p99 in ms'), table, ...outside);
}

// Adds up the figures of entities.
function sumOf(found) {
  const heard = Math.min(...found.map((row) => row.heard));
  const sum = {kind: 'all', name: found.length, node: '', heard};
  for (const key of ['rate_hz', 'cpu', 'queued', 'dropped', 'late', 'errors']) {
    sum[key] = found.reduce((total, row) => total + (row[key] ?? 0), 0);
  }
  return sum;
}

// Sections about the selection stay while it is selected, also if the drawing is made anew.
function begin(section) {
  const id = state.runs ? parts.get(chosen)?.id : undefined;
  if (section.about !== id) {
    section.replaceChildren();
    Object.assign(section, {about: id, said: undefined});
  }
  return id;
}

// What is said again changes nothing, and what somebody types stays.
function fill(section, id, said, makeItems) {
  const isUsed = (field) => field.value !== field.defaultValue || field === document.activeElement;
  const fields = [...section.querySelectorAll('input, textarea')];
  if (section.about !== id || section.said === said || fields.some(isUsed)) return;
  section.said = said;
  section.replaceChildren(...makeItems());
}

async function askParameters() {
  const section = byId('parameters');
  const id = begin(section);
  const part = parts.get(chosen);
  if (!id?.startsWith('node:')) return;
  const found = await get(`api/parameters?node=${encodeURIComponent(id.slice(5))}`);
  fill(section, id, JSON.stringify(found), () => showParameters(part, found));
}

function showParameters(part, found) {
  if (!Array.isArray(found)) return [make('p', found.problem, 'kind')];
  const list = make('dl');
  for (const each of found) {
    const about = [each.range ? `${each.range[0]} to ${each.range[1]}` : '',
      each.read_only ? 'read-only' : '', each.description].filter(Boolean).join(', ');
    const value = make('dd');
    const text = clean(each.is_cut ? each.value : JSON.stringify(each.value));
    if (state.allows_changes && !each.read_only && !each.is_cut) {
      const wish = () => ({action: 'set', name: part.id.slice(5), parameter: each.name});
      value.append(makeForm(`Set ${each.name}`, text, wish, 'Set'), clean(` ${about}`));
    } else value.append(`${text}  ${clean(about)}`);
    list.append(make('dt', each.name), value);
  }
  return [make('h2', 'Parameters'), make('p', `as of ${clock()}`, 'kind'), list];
}

// What changes the system, where the page may.
async function act(wish, told) {
  told.textContent = '…';
  const answer = await fetch('api/act', {
    method: 'POST', headers: {'content-type': 'application/json'}, body: JSON.stringify(wish),
  });
  const found = await answer.json().catch(() => ({problem: `refused (${answer.status})`}));
  told.textContent = clean(found.problem ?? found.text);
  told.className = found.problem ? 'error' : '';
}

// A field for a value or a payload, with what came of it below.
function makeForm(label, text, wish, verb) {
  const form = make('form');
  const field = make(text.includes('\n') ? 'textarea' : 'input');
  const told = make('pre');
  told.setAttribute('role', 'status');
  field.defaultValue = text;
  field.setAttribute('aria-label', label);
  if (field.tagName === 'TEXTAREA') field.rows = Math.min(12, text.split('\n').length);
  const button = make('button', verb);
  form.append(field, button, told);
  form.addEventListener('submit', (event) => {
    event.preventDefault();
    act({...wish(), text: field.value}, told);
  });
  return form;
}

async function offerActs() {
  const section = byId('acts');
  const focused = [...section.querySelectorAll('button')].indexOf(document.activeElement);
  const id = begin(section);
  const part = parts.get(chosen);
  if (!state.allows_changes || !id) return;
  if (part.kind === 'node') {
    const name = id.slice(5);
    const verbs = state.status?.stopped?.includes(name) ? ['Start'] : ['Restart', 'Stop'];
    fill(section, id, verbs[0], () => {
      const told = make('p');
      told.setAttribute('role', 'status');
      return [...verbs.flatMap((verb) => [makeButton(`${verb} the node`,
        () => act({action: verb.toLowerCase(), name}, told)), ' ']), told];
    });
    const buttons = section.querySelectorAll('button');
    if (focused >= 0) buttons[Math.min(focused, buttons.length - 1)].focus();
  } else if (part.kind === 'topic' || part.kind === 'service') {
    const [verb, action] = part.kind === 'topic' ? ['Publish once', 'publish'] : ['Call', 'call'];
    const found = await get(`api/template?kind=${part.kind}&name=${encodeURIComponent(part.name)}`);
    if (found.problem) return;
    const wish = () => ({action, name: part.name});
    fill(section, id, JSON.stringify(found), () => [make('h2', verb), make('p', found.type, 'kind'),
      makeForm(`Fields of ${found.type}`, `${found.text}\n`, wish, verb)]);
  }
}

// What a reload would do to what runs, before it is done; and what the last one did.
function showPlans() {
  const next = state.next;
  const last = state.status?.last_reload;
  byId('next').hidden = !next;
  const shown = JSON.stringify([next, last, state.allows_changes]);
  if (byId('changes').dataset.shown === shown) return;
  byId('changes').dataset.shown = shown;
  byId('plan').textContent = clean((next?.lines ?? []).join('\n'));
  byId('plan').hidden = !next?.lines.length;
  byId('refused').replaceChildren(...(next?.findings ?? []).map((finding) => {
    const text = makeFinding(finding);
    text.append(' ', makePlace(finding.file, finding.line));
    return text;
  }));
  byId('reload').hidden = !(state.allows_changes && next && !next.findings.length);
  byId('last').textContent = last
    ? `Last reload, ${clock(last.time)}: ${last.message || (last.succeeded ? 'done' : 'failed')}` : '';
}
byId('reload').addEventListener('click', () => act({action: 'reload'}, byId('told')));

function showRecording() {
  const {target = '', told = ''} = state.recording ?? {};
  byId('recording').hidden = !(state.allows_changes && state.runs);
  byId('record').textContent = target ? 'End the recording' : 'Record';
  byId('recorded').textContent = clean(target || told);
}
byId('record').addEventListener('click', () => act(
  {action: state.recording.target ? 'end_record' : 'record'}, byId('recorded')));

// Messages of the chosen topic, one a second, from when somebody asks for them until he pauses.
function offerMessage() {
  const section = byId('message');
  const before = section.about;
  const part = parts.get(chosen);
  if (begin(section) === before || part?.kind !== 'topic') return;
  const [about, image, text] = [make('p', '', 'kind'), make('canvas'), make('pre')];
  let looks = false;
  const look = async () => {
    if (!looks || !button.isConnected) return;
    const begun = Date.now();
    const found = await get(`api/message?topic=${encodeURIComponent(part.name)}`);
    if (!looks) return;
    about.textContent = `as of ${clock()}`;
    text.textContent = clean(found.text ?? found.problem);
    image.hidden = !found.image;
    if (found.image) paintImage(image, found.image);
    if (!text.isConnected) section.append(about, image, text);
    // Of a slow topic, one at a time: the page waits for it.
    if (found.problem || Date.now() - begun > SAMPLE_MS) button.click();
    else setTimeout(look, SAMPLE_MS);
  };
  const button = makeButton('Look at messages', () => {
    looks = !looks;
    button.textContent = looks ? 'Pause' : 'Go on';
    look();
  });
  section.append(make('h2', 'Message'), button);
}

function paintImage(canvas, {width, height, rgb}) {
  Object.assign(canvas, {width, height});
  const bytes = atob(rgb);
  const picture = new ImageData(width, height);
  for (let index = 0; index < width * height; index++) {
    for (let part = 0; part < 3; part++) picture.data[4 * index + part] = bytes.charCodeAt(3 * index + part);
    picture.data[4 * index + 3] = 255;
  }
  canvas.getContext('2d').putImageData(picture, 0, 0);
}

// The log: all of it, or that of the chosen node.
const lines = [];

async function fetchLog() {
  const last = lines.length ? lines[lines.length - 1].number : 0;
  const more = await get(`api/log?after=${last}`);
  if (!more.length) return;
  lines.push(...more);
  lines.splice(0, Math.max(0, lines.length - MOST_LINES));
  showLog();
}

function showLog() {
  const part = parts.get(chosen);
  const name = part?.id.startsWith('node:') ? part.id.slice(6).replaceAll('/', '.') : null;
  const shown = lines.filter((line) => name === null || line.name === name);
  byId('log').replaceChildren(...shown.slice(-MOST_LINES).reverse().map((line) => {
    const level = {warn: 'warn', error: 'error', fatal: 'error'}[line.level] ?? 'ok';
    const item = make('li', '', level);
    item.append(make('span', `${clock(line.time)} ${line.name} `, 'place'), clean(line.text));
    return item;
  }));
}

function showSummary() {
  byId('name').textContent = state.name || 'Composer';
  document.title = `${(state.problems ?? []).length ? '● ' : ''}${state.name || 'Composer'}`;
  const status = state.status;
  stamp(byId('summary'), status?.heard, status?.period_sec);
  const cpu = (state.health?.processes ?? []).reduce((sum, each) => sum + (each.cpu ?? 0), 0);
  byId('summary').textContent = status
    ? `${state.runs ? status.state : 'gone'}, `
      + `${status.nodes.length} nodes, ${(100 * cpu).toFixed(0)} % of a core, ${status.host}, `
      + `process ${status.pid}, ${status.file.slice(status.file.lastIndexOf('/') + 1)}`
    : state.problem || 'a file: nothing runs';
}

function take(next) {
  const stopped = String(state.status?.stopped);
  state = next;
  ahead = Date.now() / 1000 - state.time;
  for (const row of rows()) {
    const key = keyOf(row);
    rates.set(key, [...(rates.get(key) ?? []), row.rate_hz ?? 0].slice(-MOST_POINTS));
  }
  if (state.drawing !== drawn) {
    drawn = state.drawing;
    draw().then(showProblems);
  }
  mark();
  showSummary();
  showProblems();
  showPlans();
  showRecording();
  if (stopped !== String(state.status?.stopped)) offerActs();
  showTree();
  showLive();
  stampParts();
  if (state.runs) fetchLog();
}

window.addEventListener('resize', () => (showsAll ? fit() : show(shaped(view))));
window.addEventListener('hashchange', async (event) => {
  // By now, a drawing that came may have put into the address what was selected before.
  await draw(restore(new URL(event.newURL)));
  if (chosen !== null) bringIn(shapeOf(chosen));
});
setInterval(showAges, 500);
const events = new EventSource('api/events');
events.addEventListener('message', (event) => take(JSON.parse(event.data)));
