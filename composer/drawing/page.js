'use strict';
// Everything shown comes from the data of the page, and is set as text, never as markup.
const system = JSON.parse(document.getElementById('system').textContent);
const stage = document.getElementById('stage');
const svg = stage.querySelector('svg');
const search = document.getElementById('search');
const parts = new Map(Object.entries(system.parts));
const MOST_MATCHES = 200;

// The view: a rectangle of the drawing, moved and resized by its viewBox.
const whole = svg.viewBox.baseVal;
const all = {x: whole.x, y: whole.y, width: whole.width, height: whole.height};
let view = {...all};

function show(next) {
  view = next;
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
  }));
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
function make(tag, text = '', className = '') {
  const element = document.createElement(tag);
  element.textContent = text;
  if (className) element.className = className;
  return element;
}

function makeLink(token, text) {
  const button = make('button', text);
  button.type = 'button';
  button.dataset.token = token;
  button.addEventListener('click', () => choose(token, true));
  const item = make('li');
  item.append(button);
  return item;
}

function makeExcerpt(excerpt) {
  const block = document.createDocumentFragment();
  block.append(make('p', `${excerpt.file}:${excerpt.first}`, 'place'));
  const text = make('pre');
  const width = String(excerpt.first + excerpt.lines.length - 1).length;
  excerpt.lines.forEach((line, index) => {
    text.append(make('span', `${String(excerpt.first + index).padStart(width)}  `, 'number'));
    text.append(`${line}\n`);
  });
  block.append(text);
  return block;
}

function makeFinding(finding) {
  const text = make('p', '', finding.severity);
  text.append(make('b', finding.severity), ` ${finding.rule}: ${finding.message}`);
  if (finding.help) text.append(make('br'), make('span', `help: ${finding.help}`, 'kind'));
  return text;
}

function describe(token) {
  const part = parts.get(token);
  const details = document.getElementById('details');
  details.replaceChildren();
  if (!part) return;
  const heading = make('h2', part.name);
  heading.append(' ', make('span', part.kind, 'kind'));
  details.append(heading);
  for (const fact of part.facts) details.append(make('p', fact));
  for (const index of part.findings) details.append(makeFinding(system.findings[index]));
  for (const excerpt of part.excerpts) details.append(makeExcerpt(excerpt));
  if (part.near.length) {
    const list = make('ul');
    for (const near of part.near) {
      // From a node past its publisher, say, to the topic.
      const far = near[0] === 'e' ? parts.get(near).near.find((each) => each !== token) : near;
      list.append(makeLink(far, `${parts.get(near).kind} ${parts.get(far).name}`));
    }
    details.append(make('h2', 'Connected'), list);
  }
}

// Selection, by pointer, keyboard, list or address.
const drawn = (token) => document.getElementById(token);
let chosen = null;

function choose(token, mustBeSeen) {
  for (const element of svg.querySelectorAll('.chosen, .near')) {
    element.classList.remove('chosen', 'near');
  }
  chosen = parts.has(token) ? token : null;
  svg.classList.toggle('choosing', chosen !== null);
  describe(chosen);
  if (chosen === null) return;
  drawn(token).classList.add('chosen', 'near');
  for (const near of parts.get(token).near) {
    drawn(near).classList.add('near');
    for (const far of parts.get(near).near) if (near[0] === 'e') drawn(far).classList.add('near');
  }
  if (mustBeSeen) bringIn(drawn(token));
}

for (const [token, part] of parts) {
  const element = drawn(token);
  element.classList.add('known');
  if (token[0] === 'e') {
    const reach = element.querySelector('path').cloneNode();
    reach.setAttribute('class', 'reach');
    element.append(reach);
  } else {
    element.setAttribute('tabindex', '0');
    element.setAttribute('role', 'button');
    element.setAttribute('aria-label', `${part.kind} ${part.name}`);
    element.addEventListener('focus', () => { if (!isInView(element)) bringIn(element); });
  }
  element.addEventListener('keydown', (event) => {
    if (event.key !== 'Enter' && event.key !== ' ') return;
    event.preventDefault();
    choose(token, false);
  });
}

// The pointer: drag to move, click to select, turn the wheel to zoom.
let drag = null;
stage.addEventListener('pointerdown', (event) => {
  if (event.button !== 0) return;
  drag = {x: event.clientX, y: event.clientY, view, moved: false};
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
stage.addEventListener('pointerup', (event) => {
  if (drag && !drag.moved) choose(event.target.closest('.known')?.id, false);
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
  '+': () => zoom(0.8), '=': () => zoom(0.8), '-': () => zoom(1.25), 0: fit,
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
document.getElementById('zoom-in').addEventListener('click', () => zoom(0.8));
document.getElementById('zoom-out').addEventListener('click', () => zoom(1.25));
document.getElementById('fit').addEventListener('click', fit);

// The search: each word must be in the kind, the name or the facts.
function find() {
  const words = search.value.toLowerCase().split(/\s+/).filter(Boolean);
  const found = [];
  for (const [token, part] of parts) {
    const text = [part.kind, part.name, ...part.facts].join('\n').toLowerCase();
    const matches = words.length > 0 && words.every((word) => text.includes(word));
    drawn(token).classList.toggle('match', matches);
    if (matches && token[0] !== 'e') found.push(token);
  }
  svg.classList.toggle('searching', words.length > 0);
  document.getElementById('count').textContent = words.length ? `${found.length} found` : '';
  document.getElementById('matches').replaceChildren(...found.slice(0, MOST_MATCHES).map(
    (token) => makeLink(token, `${parts.get(token).kind} ${parts.get(token).name}`),
  ));
  return found;
}
search.addEventListener('input', find);
search.addEventListener('keydown', (event) => {
  if (event.key !== 'Enter') return;
  // Enter goes from one match to the next.
  const found = find();
  if (found.length) choose(found[(found.indexOf(chosen) + 1) % found.length], true);
});

function listFindings() {
  const section = document.getElementById('findings');
  section.append(make('h2', system.findings.length ? 'Findings' : 'No findings'));
  const list = make('ul');
  for (const finding of system.findings) {
    const item = finding.part ? makeLink(finding.part, '') : make('li');
    const place = finding.line ? `${finding.file}:${finding.line}` : finding.file;
    const text = make('span', '', finding.severity);
    text.append(make('b', finding.severity), ` ${finding.message} `, make('span', place, 'place'));
    (item.firstChild ?? item).append(text);
    list.append(item);
  }
  section.append(list);
}

listFindings();
fit();
window.addEventListener('resize', () => show(shaped(view)));
if (parts.has(location.hash.slice(1))) choose(location.hash.slice(1), true);
