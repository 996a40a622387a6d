"use strict";
// Five short steps for who comes for the first time; skipped once, it is not shown again here.
(() => {
  const SEEN = "flinch-tour";
  const STEPS = [
    ["", "This arm wears its sensors as a skin",
      "The ball comes near, the sensors see it as points, and the arm gives way with its whole body. "
      + "It knows nothing but those points."],
    ["[data-arm], .arm-line", "What it does, in words",
      "Free, slowed, pushed back or blocked, and by what. Below it two distances: of what can give "
      + "way, and of what cannot. Run, Hold and Stop stay where they are; the space bar stops too."],
    ["[role=tab]", "Get in its way",
      "Under Cell you put a body in front of the tool. Drag it to the elbow with the mouse; with "
      + "Shift it keeps its height."],
    ["", "Move the goal",
      "Drag the arrows and arcs at the tool. The arm goes there as far as what is near allows. "
      + "Left button turns the picture, right button shifts it, the wheel zooms."],
    ["div:has(> div > [data-legend])", "What is what",
      "Each entry of the legend is a switch. All the rest is under Help, this tour as well."],
  ];
  let card = null;
  let at = 0;

  const seen = () => {
    try { return localStorage.getItem(SEEN) !== null; } catch { return true; } // no storage: no tour
  };
  const keep = () => { try { localStorage.setItem(SEEN, "1"); } catch { /* asked again, then */ } };

  function mark(selector) {
    for (const one of document.querySelectorAll(".flinch-marked")) {
      one.classList.remove("flinch-marked");
    }
    if (selector) {
      for (const one of document.querySelectorAll(selector)) one.classList.add("flinch-marked");
    }
  }

  function make(kind, parent, text, press) {
    const one = parent.appendChild(document.createElement(kind));
    one.textContent = text;
    if (press) one.addEventListener("click", press);
    return one;
  }

  function end() {
    keep();
    mark("");
    card?.remove();
    card = null;
  }

  function show(step) {
    at = step;
    if (at >= STEPS.length) return end();
    const [selector, title, text] = STEPS[at];
    card ??= document.body.appendChild(document.createElement("div"));
    card.className = "flinch-tour";
    card.setAttribute("role", "dialog");
    card.setAttribute("aria-label", title);
    card.replaceChildren();
    make("b", card, title);
    make("p", card, text);
    const row = make("div", card, "");
    make("span", row, `${at + 1} of ${STEPS.length}`);
    make("button", row, "Skip", end).title = "Do not show the tour again";
    const last = at === STEPS.length - 1;
    make("button", row, last ? "Done" : "Next", () => show(at + 1)).title = "Go on with the tour";
    mark(selector);
  }

  document.addEventListener("click", (event) => {
    if (event.target.closest?.("[data-flinch-tour]")) show(0);
  });
  const wait = setInterval(() => { // until there is something to look at
    const beat = document.querySelector("[data-beat]")?.dataset.beat;
    if (beat === undefined || beat === "0") return;
    clearInterval(wait);
    if (!seen() && !document.documentElement.classList.contains("flinch-old")) show(0);
  }, 500);
})();
