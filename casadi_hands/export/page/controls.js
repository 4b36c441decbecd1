"use strict";
// Buttons, the clock and the address, for one scene or for several that move together.
function controls(stages) {
  const found = (id) => document.getElementById(id);
  const all = (key) => stages.flatMap((stage) => stage[key]);
  const distinct = (items) => items.filter((item, k) => items.findIndex((other) => other.name === item.name) === k);
  // A button that was pressed with a pointer leaves the keyboard to the clock.
  document.addEventListener("click", (event) => { if (event.detail && document.activeElement) document.activeElement.blur(); });

  function box(label, on, color, change) {
    const row = document.createElement("label"), input = document.createElement("input");
    input.type = "checkbox";
    input.checked = on;
    input.onchange = () => change(input.checked);
    row.append(input, label);
    if (color) row.append(document.createElement("i"));
    if (color) row.style.setProperty("--color", color);
    found("layers").append(row);
    change(on);
  }
  for (const { name, on, color } of distinct(all("layers"))) {
    box(name, on, color, (shown) => { for (const stage of stages) stage.layer(name, shown); });
  }
  box("See-through hand", false, null, (on) => { for (const stage of stages) stage.seeThrough(on); });
  for (const { name } of distinct(all("views"))) {
    const button = document.createElement("button");
    button.textContent = name;
    button.onclick = () => { for (const stage of stages) stage.look(name); };
    found("views").append(button);
  }
  found("tools").open = window.innerWidth > 900;

  const begin = Math.min(...stages.map((stage) => stage.span[0])), end = Math.max(...stages.map((stage) => stage.span[1]));
  if (end <= begin) {
    document.body.classList.toggle("still", new URLSearchParams(location.hash.slice(1)).has("still"));
    return;
  }
  const [bar, player, play, back, forth, scrub, clock, speed] =
    ["bar", "player", "play", "back", "forth", "scrub", "clock", "speed"].map(found);
  const samples = [...new Set(all("samples"))].sort((one, other) => one - other);
  bar.hidden = player.hidden = false;
  scrub.min = begin;
  scrub.max = end;
  let time = begin, playing = true, last = null, waiting = null;

  function show() {
    for (const stage of stages) stage.show(time);
    scrub.value = time;
    clock.textContent = `${time.toFixed(2)} / ${end.toFixed(2)} s`;
    play.classList.toggle("playing", playing);
  }
  // The address has the time while it stands, so that it can be sent or opened again; browsers take few changes a second.
  function note() {
    if (location.protocol === "about:") return;
    clearTimeout(waiting);
    waiting = setTimeout(() => {
      const parts = new URLSearchParams(location.hash.slice(1));
      if (playing) parts.delete("t"); else parts.set("t", String(Number(time.toFixed(4))));
      const fragment = parts.toString().replaceAll("=&", "&").replace(/=$/, "");
      history.replaceState(null, "", fragment ? `#${fragment}` : location.pathname + location.search);
    }, 150);
  }
  function rest(at) { time = Math.min(end, Math.max(begin, at)); playing = false; show(); note(); }
  function step(now) {
    if (playing) {
      if (last !== null) time += (now - last) / 1000 * Number(speed.value);
      if (time > end) time = begin + (time - begin) % (end - begin);
      show();
    }
    last = now;
    requestAnimationFrame(step);
  }
  // A fragment such as #t=1.5 opens the page at that time, at rest.
  function jump() {
    const parts = new URLSearchParams(location.hash.slice(1));
    if (document.body.classList.contains("still") !== parts.has("still")) {
      document.body.classList.toggle("still");
      makeRoom();
    }
    const wanted = parts.get("t") ?? stages[0].start;
    if (wanted !== null && wanted !== "" && Number.isFinite(Number(wanted))) rest(Number(wanted));
  }
  function makeRoom() {
    for (const stage of stages) if (stage.window === window) stage.above(() => bar.offsetHeight);
  }
  const hair = 1e-6 * (end - begin);
  const steps = {
    ArrowLeft: () => rest(samples.findLast((each) => each < time - hair) ?? begin),
    ArrowRight: () => rest(samples.find((each) => each > time + hair) ?? end),
    Home: () => rest(begin),
    End: () => rest(end),
    " ": () => play.onclick(),
  };
  play.onclick = () => { playing = !playing; show(); note(); };
  back.onclick = steps.ArrowLeft;
  forth.onclick = steps.ArrowRight;
  scrub.oninput = () => rest(Number(scrub.value));
  speed.onchange = () => speed.blur();
  window.onhashchange = jump;
  // Space presses the button that it is on, arrows choose in a list; else they are the clock's.
  window.onkeydown = (event) => {
    const at = event.target instanceof Element ? event.target : document.body;
    const taken = at.closest("select") || (event.key === " " && at.closest("button, input[type=checkbox], summary, a"));
    if (!steps[event.key] || taken || event.ctrlKey || event.altKey || event.metaKey) return;
    event.preventDefault();
    steps[event.key]();
  };
  for (const stage of stages) {
    if (stage.window !== window) stage.window.addEventListener("keydown", window.onkeydown);
  }
  makeRoom();
  show();
  jump();
  requestAnimationFrame(step);
}
