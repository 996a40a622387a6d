"use strict";
// One clock for all scenes and charts of this page. The scenes are viser's own pages, each in a
// frame of its own; nothing is fetched from anywhere.
const facts = JSON.parse(document.getElementById("facts").textContent);
const viewer = JSON.parse(document.getElementById("viewer").textContent);
const clips = facts.clips;
const times = clips.reduce((a, b) => (b.times.length > a.times.length ? b : a)).times;
const period = times.length > 1 ? times[times.length - 1] / (times.length - 1) : 0.05;
const length = times[times.length - 1] + period; // [s] the last picture stays as long as others
const find = (id) => document.getElementById(id);
const make = (kind, parent, text) => {
  const element = document.createElement(kind);
  if (text !== undefined) element.textContent = text;
  return parent.appendChild(element);
};
const several = clips.length > 1;
const COLOURS = { distance: "#0072bd", own: "#56b4e9", kept: "#cc3322", begins: "#e69f00",
  ghost: "#785ac8", separation: "#82878e", activation: "#cc3322" };
const CLIPS = ["#0072bd", "#d55e00", "#009e73", "#785ac8"];
const MARKS = { stop: "#cc3322", mode: "#5b6675", controller: "#785ac8", touch: "#d6278c",
  waypoint: "#2e8b57" };

// --- the clock ------------------------------------------------------------------------------

const hash = new URLSearchParams(location.hash.slice(1));
let time = Math.min(Math.max(parseFloat(hash.get("t")) || 0, 0), length - 1e-3);
let playing = !hash.has("t");
let speed = 1;
let shown = [];

function at(clip, t) { // the picture of a clip at a time
  let low = 0, high = clip.times.length - 1;
  while (low < high) {
    const middle = (low + high + 1) >> 1;
    if (clip.times[middle] <= t + 1e-6) low = middle; else high = middle - 1;
  }
  return low;
}

function seek(t, stop = true) {
  time = Math.min(Math.max(t, 0), length - 1e-3);
  if (stop) setPlaying(false);
  if (ready()) show(); else tellTime();
}

const ready = () => players.every((p) => p);

function step(by) {
  const main = clips.find((c) => c.times === times);
  seek(times[Math.min(Math.max(at(main, time) + by, 0), times.length - 1)]);
}

function setPlaying(on) {
  playing = on;
  find("play").textContent = on ? "❚❚ Pause" : "▶ Play";
}

function show() {
  clips.forEach((clip, k) => {
    const i = at(clip, time), player = players[k];
    const due = Math.min(clip.times[i] + 1e-4, player.length - 1e-3);
    if (shown[k] !== i || player.says() !== due.toFixed(1)) {
      shown[k] = i;
      player.seek(due);
      caption(clip, k, i);
    }
  });
  tellTime();
}

function tellTime() {
  find("clock").textContent = `${time.toFixed(2)} / ${length.toFixed(1)} s`;
  moveCursor();
}

let last;
function tick() { // no picture's business: a browser without a graphics card draws few of them
  const now = performance.now();
  if (playing && ready() && last !== undefined) {
    time += Math.min((now - last) / 1000, 0.25) * speed;
    if (time >= length - 1e-3) time = 0;
  }
  last = now;
  if (ready()) show();
}

// --- the scenes -----------------------------------------------------------------------------

const players = clips.map(() => null);
const captions = clips.map((clip, k) => {
  const figure = make("figure", find("scenes"));
  const frame = make("iframe", figure);
  frame.title = `Scene of ${clip.name}`;
  frame.tabIndex = -1;
  const tag = '<style>.mantine-Paper-root:has(.mantine-Slider-root),.mantine-Notifications-root' +
    "{display:none!important}</style>";
  frame.srcdoc = viewer.before + `parent.document.getElementById("scene-${k}").textContent.trim()` +
    viewer.after.replace("</head>", () => `${tag}</head>`);
  const tell = make("figcaption", figure);
  const name = make("b", tell);
  if (several) make("i", name).style.background = CLIPS[k % CLIPS.length];
  name.append(clip.name);
  return { closest: make("span", tell), state: make("span", tell), figure, frame };
});

function caption(clip, k, i) {
  const [state, closest] = clip.words[i];
  captions[k].closest.textContent = closest;
  captions[k].state.textContent = state;
}

// viser's player is asked through its own slider, by what React keeps of it on the page.
function playerOf(frame) {
  const slider = frame.contentDocument?.querySelector(".mantine-Slider-root");
  const key = slider && Object.keys(slider).find((k) => k.startsWith("__reactFiber$"));
  if (!key || !frame.contentWindow.__viserMutable) return null;
  let seekTo, end, tree;
  for (let fiber = slider[key]; fiber; fiber = fiber.return) {
    const props = fiber.memoizedProps;
    if (!seekTo && typeof props?.onChange === "function" && props.max > 0) {
      seekTo = props.onChange;
      end = props.max;
    }
    if (props?.value?.sceneTreeActions) { tree = props.value; break; }
  }
  const number = frame.contentDocument.querySelector(".mantine-NumberInput-input");
  if (!seekTo || !tree || !number) return null;
  // it plays by itself until it is asked the first time, and may overtake the answer
  const says = () => number.value;
  return { seek: seekTo, says, length: end, tree, window: frame.contentWindow };
}

function join() { // as soon as each scene has come
  captions.forEach(({ frame }, k) => {
    if (players[k]) return;
    players[k] = playerOf(frame);
    if (!players[k]) return;
    players[k].window.addEventListener("keydown", keys, true);
    legend.forEach((entry) => entry.apply(k));
  });
  if (ready()) {
    document.body.dataset.ready = "yes";
    together();
    show();
  } else setTimeout(join, 50);
}

function together() { // who turns one scene turns them all
  const cameras = players.map((p) => p.window.__viserMutable.cameraControl);
  if (!several || !cameras.every((c) => c && c.setLookAt)) return;
  cameras.forEach((camera) => camera.addEventListener("control", () => {
    const eye = camera.getPosition(camera._position?.clone()), look = camera.getTarget(eye.clone());
    cameras.forEach((other) => {
      if (other !== camera) other.setLookAt(eye.x, eye.y, eye.z, look.x, look.y, look.z, false);
    });
  }));
}

// --- the legend, which shows and hides ------------------------------------------------------

const SHAPES = {
  dot: (c) => `<circle cx="${c.x}" cy="6" r="4" fill="${c.fill}"/>`,
  line: (c) => `<path d="M${c.x - 4} 6h8" stroke="${c.fill}" stroke-width="3"/>`,
  area: (c) => `<rect x="${c.x - 4}" y="1" width="8" height="10" rx="1" fill="${c.fill}" opacity=".8"/>`,
  cone: (c) => `<path d="M${c.x} 11L${c.x - 4} 1h8z" fill="${c.fill}"/>`,
};

const legend = facts.legend.map((entry) => {
  const button = make("button", find("legend"));
  const wide = 9 * entry.colours.length + 3;
  const marks = entry.colours.map((fill, n) => SHAPES[entry.shape]({ x: 6 + 9 * n, fill })).join("");
  button.innerHTML = `<svg viewBox="0 0 ${wide} 12" style="width:${wide / 12}em">${marks}</svg>`;
  button.append(entry.label);
  button.title = `${entry.help} (press to show or hide)`;
  let on = entry.on;
  const nodes = new RegExp(entry.nodes);
  const apply = (k) => {
    const { tree } = players[k];
    for (const name of Object.keys(tree.useSceneTree.getAll())) {
      if (nodes.test(name)) {
        tree.sceneTreeActions.updateNodeAttributes(name, { overrideVisibility: on ? undefined : false });
      }
    }
    tree.mutable.current.requestRender?.();
  };
  const set = (value) => {
    on = value;
    button.setAttribute("aria-pressed", String(on));
    players.forEach((p, k) => p && apply(k));
  };
  button.setAttribute("aria-pressed", String(on));
  button.addEventListener("click", () => set(!on));
  return { apply };
});

// --- the charts -----------------------------------------------------------------------------

const charts = find("charts");
const LEFT = 46, RIGHT = 12, TOP = 20, GAP = 16, BOTTOM = 20;
const HEIGHTS = [118, 44]; // [px] of distance and activation
const plot = make("canvas", charts);
const cursor = make("div", charts);
const hint = make("div", charts);
cursor.id = "cursor";
hint.id = "hint";
hint.hidden = true;

const values = (name) => clips.flatMap((c) => c.curves[name]).filter((v) => v !== null);
const has = (name) => values(name).length > 0;
const highest = Math.min(Math.max(...values("distance"), ...values("begins").slice(0, 1), 0.2), 1.2);
const x = (t) => LEFT + (t / length) * (charts.clientWidth - LEFT - RIGHT);

function rows() { // what is drawn: name in words, colour, clip, column, look
  const out = [];
  const line = (label, column, colour, clip, look = {}) =>
    clip.curves[column].some((v) => v !== null) && out.push({ label, column, colour, clip, ...look });
  clips.forEach((clip, k) => {
    line(several ? clip.name : "whole arm", "distance", several ? CLIPS[k % CLIPS.length] :
      COLOURS.distance, clip, { width: 2 });
    if (!several) line("as the controller looks", "own", COLOURS.own, clip, { width: 1.2 });
    if (!several) line("ghost, within 0.5 s", "ghost", COLOURS.ghost, clip, { width: 1.5 });
    if (!several) line("separation needed", "separation", COLOURS.separation, clip, { dash: [2, 3] });
  });
  line("distance kept", "kept", COLOURS.kept, clips[0], { dash: [6, 4] });
  if (!several) line("avoidance begins", "begins", COLOURS.begins, clips[0], { dash: [6, 4] });
  return out;
}

function draw() {
  const scale = window.devicePixelRatio || 1, wide = charts.clientWidth;
  const tall = TOP + HEIGHTS[0] + GAP + HEIGHTS[1] + BOTTOM;
  plot.width = wide * scale;
  plot.height = tall * scale;
  plot.style.height = `${tall}px`;
  const g = plot.getContext("2d");
  g.scale(scale, scale);
  const ink = getComputedStyle(document.documentElement);
  const colour = (name) => ink.getPropertyValue(name).trim();
  g.font = "11px system-ui, 'DejaVu Sans', sans-serif";
  const y1 = (v) => TOP + HEIGHTS[0] * (1 - Math.min(v, highest * 1.05) / (highest * 1.05));
  const base = TOP + HEIGHTS[0] + GAP + HEIGHTS[1];
  const y2 = (v) => base - HEIGHTS[1] * (v / 1.08);
  const text = (words, px, py, align, shade = colour("--quiet")) => {
    g.fillStyle = shade;
    g.textAlign = align;
    g.fillText(words, px, py);
  };
  const rule = (px, py, qx, qy, shade, dash = []) => {
    g.beginPath(); g.setLineDash(dash); g.moveTo(px, py); g.lineTo(qx, qy);
    g.strokeStyle = shade; g.lineWidth = 1; g.stroke(); g.setLineDash([]);
  };
  const every = [0.1, 0.2, 0.5, 1, 2, 5, 10, 30, 60].find((s) => length / s <= 14) || 120;
  for (let t = 0; t <= length; t += every) {
    rule(x(t), TOP, x(t), base, colour("--line"));
    text(`${+t.toFixed(1)}${t === 0 ? " s" : ""}`, x(t), base + 14, "center");
  }
  const tens = highest > 0.6 ? 0.25 : 0.1;
  for (let v = 0; v <= highest * 1.05; v += tens) {
    rule(LEFT, y1(v), wide - RIGHT, y1(v), colour("--line"));
    text(`${Math.round(100 * v)}`, LEFT - 6, y1(v) + 4, "right");
  }
  for (const v of [0, 1]) {
    rule(LEFT, y2(v), wide - RIGHT, y2(v), colour("--line"));
    text(`${v}`, LEFT - 6, y2(v) + 4, "right");
  }
  // what stands out of the frame is cut; titles and names above it
  const curve = (clip, column, y, shade, width = 1, dash = []) => {
    g.beginPath(); g.setLineDash(dash); g.strokeStyle = shade; g.lineWidth = width;
    g.lineJoin = "round";
    let on = false;
    clip.curves[column].forEach((v, i) => {
      if (v === null) { on = false; return; }
      if (on) g.lineTo(x(clip.times[i]), y(v)); else g.moveTo(x(clip.times[i]), y(v));
      on = true;
    });
    g.stroke(); g.setLineDash([]);
  };
  clips.forEach((clip, k) => {
    const shade = several ? CLIPS[k % CLIPS.length] : COLOURS.activation;
    if (!several) {
      g.beginPath(); g.moveTo(x(0), y2(0));
      clip.curves.activation.forEach((v, i) => g.lineTo(x(clip.times[i]), y2(v ?? 0)));
      g.lineTo(x(clip.times[clip.times.length - 1]), y2(0));
      g.fillStyle = `${shade}30`; g.fill();
    }
    curve(clip, "activation", y2, shade, 1.3);
  });
  let edge = wide - RIGHT;
  for (const r of rows().reverse()) {
    curve(r.clip, r.column, y1, r.colour, r.width ?? 1, r.dash ?? []);
    text(r.label, edge, TOP - 7, "right", colour("--ink"));
    edge -= g.measureText(r.label).width + 24;
    rule(edge, TOP - 11, edge + 18, TOP - 11, r.colour, r.dash ?? []);
    rule(edge, TOP - 10, edge + 18, TOP - 10, r.colour, r.dash ?? []);
    edge -= 16;
  }
  text("Smallest distance [cm], as the skin perceives it", LEFT, TOP - 7, "left", colour("--ink"));
  text("Activation of the avoidance, 0 to 1", LEFT, TOP + HEIGHTS[0] + GAP - 2, "left",
    colour("--ink"));
  for (const clip of clips) {
    for (const m of clip.marks) {
      const shade = MARKS[m.kind];
      rule(x(m.time), TOP, x(m.time), base, shade, [1, 2]);
      g.beginPath(); g.moveTo(x(m.time) - 4, TOP); g.lineTo(x(m.time) + 4, TOP);
      g.lineTo(x(m.time), TOP + 7); g.fillStyle = shade; g.fill();
    }
  }
  moveCursor();
}

function moveCursor() {
  cursor.style.left = `${x(time)}px`;
  charts.setAttribute("aria-valuenow", time.toFixed(2));
  charts.setAttribute("aria-valuetext", `${time.toFixed(2)} seconds`);
}

function timeUnder(event) {
  const box = charts.getBoundingClientRect();
  return ((event.clientX - box.left - LEFT) / (box.width - LEFT - RIGHT)) * length;
}

function tell(event) { // what happened near the mouse
  const t = timeUnder(event), reach = (6 / charts.clientWidth) * length;
  const near = clips.flatMap((c) => c.marks.map((m) => ({ ...m, clip: c })))
    .filter((m) => Math.abs(m.time - t) < reach);
  hint.hidden = near.length === 0;
  if (near.length) {
    hint.textContent = near.map((m) => `${m.time.toFixed(2)} s · ${m.words}`).join("  |  ");
    const room = charts.clientWidth - hint.offsetWidth;
    hint.style.left = `${Math.max(Math.min(x(near[0].time) + 6, room), 0)}px`;
  }
}

charts.addEventListener("pointerdown", (event) => {
  charts.setPointerCapture(event.pointerId);
  seek(timeUnder(event));
});
charts.addEventListener("pointermove", (event) => {
  if (charts.hasPointerCapture(event.pointerId)) seek(timeUnder(event));
  tell(event);
});
charts.addEventListener("pointerleave", () => { hint.hidden = true; });

// --- hands ----------------------------------------------------------------------------------

function keys(event) {
  if (event.target.matches?.("select, input, textarea") || event.ctrlKey || event.metaKey) return;
  const act = {
    " ": () => { if (!event.target.matches?.("#legend button, nav button")) setPlaying(!playing); },
    ArrowLeft: () => (event.shiftKey ? seek(time - 1) : step(-1)),
    ArrowRight: () => (event.shiftKey ? seek(time + 1) : step(1)),
    Home: () => seek(0),
    End: () => seek(length),
  }[event.key];
  if (!act) return;
  if (event.key !== " " || !event.target.matches?.("button")) event.preventDefault();
  event.stopImmediatePropagation();
  act();
}
window.addEventListener("keydown", keys, true);
find("play").addEventListener("click", () => setPlaying(!playing));
find("back").addEventListener("click", () => step(-1));
find("next").addEventListener("click", () => step(1));
find("speed").addEventListener("change", (event) => { speed = parseFloat(event.target.value); });

document.title = facts.title;
document.querySelector("h1").textContent = facts.title;
find("about").textContent = facts.about;
find("foot").textContent = facts.foot;
charts.setAttribute("aria-valuemax", length.toFixed(2));
setPlaying(playing);
clips.forEach((clip, k) => caption(clip, k, at(clip, time)));
new ResizeObserver(draw).observe(charts);
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", draw);
draw();
tellTime();
join();
setInterval(tick, 20);
