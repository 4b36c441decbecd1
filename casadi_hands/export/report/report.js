"use strict";
(() => {
  const data = JSON.parse(document.getElementById("data").textContent);
  const root = document.documentElement;
  const frame = document.getElementById("viewer");
  const [player, play, scrub, clock] = ["player", "play", "scrub", "clock"].map((id) => document.getElementById(id));
  const begin = data.plots ? data.plots.time[0] : 0;
  const end = data.plots ? data.plots.time[data.plots.time.length - 1] : 0;
  const DASHES = [[], [8, 4], [2, 3], [10, 3, 2, 3], [14, 4]];
  const drawn = [];
  let now = begin, playing = false, last = null;

  // The viewer's page has a clock of its own, which is followed; where it cannot draw, the time is kept here.
  const inner = (id) => frame.contentDocument && frame.contentDocument.getElementById(id);
  const followed = () => { const its = inner("player"); return its && !its.hidden ? inner("scrub") : null; };
  function seek(time) {
    now = Math.min(end, Math.max(begin, time));
    playing = false;
    const other = followed();
    if (other) { other.value = now; other.dispatchEvent(new Event("input")); }
    show();
  }
  function show() {
    for (const each of drawn) each.at(now);
    scrub.value = now;
    clock.textContent = `${now.toFixed(2)} / ${end.toFixed(2)} s`;
    play.textContent = playing ? "❚❚" : "▶";
  }
  function step(stamp) {
    const other = followed(), before = now;
    if (other) {
      now = Number(other.value);
      playing = now !== before;
    } else if (playing) {
      now += last === null ? 0 : (stamp - last) / 1000;
      if (now > end) now = begin + (now - begin) % (end - begin);
    }
    last = stamp;
    if (now !== before || playing) show();
    else if (play.textContent !== "▶") show();
    requestAnimationFrame(step);
  }

  function color(name) { return getComputedStyle(root).getPropertyValue(name).trim(); }
  function shown(value) {
    if (value == null) return "–";
    const size = Math.abs(value);
    const text = size !== 0 && (size < 1e-3 || size >= 1e5) ? value.toExponential(1) : String(Number(value.toPrecision(3)));
    return text.replaceAll("-", "−");
  }

  // One plot; `state` has a row of bars for each curve, `runs` points over the number of a run, on a logarithmic scale.
  function plot(place, time, panel) {
    const rows = panel.kind === "state", runs = panel.kind === "runs", names = panel.curves.map((each) => each.label);
    const axis = (more) => ({
      stroke: () => color("--soft"), grid: { stroke: () => color("--grid"), width: 1 }, ticks: { show: false },
      font: "12px system-ui, sans-serif", ...more,
    });
    const options = {
      width: place.clientWidth, height: rows ? 60 + 26 * names.length : 220,
      cursor: { show: false }, legend: { show: false },
      scales: {
        x: { time: false },
        y: runs ? { distr: 3 } : rows ? { range: [0.4, names.length + 0.6] } : {},
      },
      axes: [
        axis({ size: 34, values: (u, ticks) => ticks.map((t) => (runs ? t : `${shown(t)} s`)) }),
        axis(rows ? {
          size: 76, splits: () => names.map((_, k) => names.length - k),
          values: () => names.map((name) => (name.length > 9 ? name.slice(0, 8) + "…" : name)),
        } : { size: 60, values: (u, ticks) => ticks.map((v) => (v == null ? "" : shown(v))) }),
      ],
      series: [
        {},
        ...panel.curves.map((each) => ({
          label: each.label, stroke: each.color, dash: DASHES[each.dash % DASHES.length], spanGaps: false,
          width: rows ? 12 : 2,
          points: { show: runs, size: 5, fill: each.color }, ...(runs ? { paths: () => null } : {}),
          ...(rows ? { paths: uPlot.paths.stepped({ align: 1 }) } : {}),
        })),
      ],
    };
    const u = new uPlot(options, [time, ...panel.curves.map((each) => each.values)], place);
    new ResizeObserver(() => {
      if (place.clientWidth && place.clientWidth !== u.width) u.setSize({ width: place.clientWidth, height: options.height });
      if (!runs) at(now);
    }).observe(place);
    const line = document.createElement("div");
    line.className = "now";
    const values = rows ? [] : legend(place, u, panel, !runs);
    function at(t) {
      line.style.left = `${u.valToPos(t, "x") - 1}px`;
      const k = nearest(time, t);
      values.forEach((each, c) => { each.textContent = shown(panel.curves[c].values[k]); });
    }
    if (!runs) {
      u.over.appendChild(line);
      const drag = (event) => seek(u.posToVal(event.clientX - u.over.getBoundingClientRect().left, "x"));
      u.over.addEventListener("pointerdown", (event) => { u.over.setPointerCapture(event.pointerId); drag(event); });
      u.over.addEventListener("pointermove", (event) => { if (event.buttons) drag(event); });
      drawn.push({ at, u });
    }
    return u;
  }
  // What curves are, with their values at the time; pressed, one is hidden or shown.
  function legend(place, u, panel, live) {
    const list = document.createElement("div"), values = [];
    list.className = "legend";
    panel.curves.forEach((each, c) => {
      const entry = document.createElement("button"), name = document.createElement("span"), value = document.createElement("b");
      const mark = document.createElementNS("http://www.w3.org/2000/svg", "svg"), stroke = mark.appendChild(
        document.createElementNS("http://www.w3.org/2000/svg", "line"));
      for (const [key, given] of Object.entries({ viewBox: "0 0 26 8", width: 26, height: 8 })) mark.setAttribute(key, given);
      const look = { x1: 0, y1: 4, x2: 26, y2: 4, stroke: each.color, "stroke-width": 3, "stroke-dasharray": DASHES[each.dash % DASHES.length].join(" ") };
      for (const [key, given] of Object.entries(look)) stroke.setAttribute(key, given);
      name.textContent = each.label;
      entry.setAttribute("aria-pressed", "true");
      entry.onclick = () => {
        const show = entry.getAttribute("aria-pressed") !== "true";
        entry.setAttribute("aria-pressed", String(show));
        u.setSeries(c + 1, { show });
      };
      entry.append(mark, name);
      if (live) { entry.append(value); values.push(value); }
      list.append(entry);
    });
    place.append(list);
    return values;
  }
  function nearest(time, t) {
    let low = 0, high = time.length - 1;
    while (high - low > 1) { const mid = (low + high) >> 1; if (time[mid] <= t) low = mid; else high = mid; }
    return t - time[low] < time[high] - t ? low : high;
  }

  const all = [];
  for (const panel of data.plots ? data.plots.panels : []) {
    all.push(plot(document.querySelector(`[data-panel="${panel.key}"]`), data.plots.time, panel));
  }
  const runs = document.getElementById("runs");
  if (runs && data.runs) all.push(plot(runs, data.runs.time, data.runs.panels[0]));
  const redraw = () => { for (const u of all) u.redraw(false, true); };
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", redraw);
  let folded = [];
  addEventListener("beforeprint", () => {
    root.dataset.printing = "";
    folded = [...document.querySelectorAll("details:not([open])")];
    for (const each of folded) each.open = true;
    redraw();
  });
  addEventListener("afterprint", () => {
    delete root.dataset.printing;
    for (const each of folded) each.open = false;
    redraw();
  });

  // The bar at the bottom is for when the viewer, which has one too, is not in sight.
  if (end > begin) {
    scrub.min = begin;
    scrub.max = end;
    scrub.oninput = () => seek(Number(scrub.value));
    play.onclick = () => { if (followed()) inner("play").click(); else playing = !playing; show(); };
    new IntersectionObserver(([entry]) => { player.hidden = entry.intersectionRatio > 0.6; }, { threshold: [0, 0.6, 0.61] }).observe(frame);
    show();
    requestAnimationFrame(step);
  }

  // Added to the viewer's page: what this page says already is left out, and pictures are taken.
  const ADDED = `<style>#about h1, #about p, #parts { display: none !important; }</style>
<script>window.picture = () => {
  const { camera, renderer, scene } = viewer, view = { ...camera.view };
  camera.clearViewOffset();  // nothing stands before a picture
  renderer.render(scene, camera);
  camera.setViewOffset(view.fullWidth, view.fullHeight, view.offsetX, view.offsetY, view.width, view.height);
  return renderer.domElement.toDataURL("image/jpeg", 0.85);
};<\/script></body>`;
  async function open() {
    const packed = Uint8Array.from(atob(document.getElementById("scene").textContent), (c) => c.charCodeAt(0));
    const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"));
    const page = await new Response(stream).text();
    await new Promise((done) => {
      frame.onload = done;
      frame.srcdoc = page.slice(0, page.lastIndexOf("</body>")) + ADDED + page.slice(page.lastIndexOf("</body>") + 7);
    });
    if (end > begin) pictures();
  }
  function pictures() {
    const picture = frame.contentWindow.picture, other = followed();
    if (!picture || !other) return;
    const strip = document.getElementById("goals"), resume = now;
    for (const goal of data.goals) {
      other.value = goal.time;
      other.dispatchEvent(new Event("input"));
      const button = document.createElement("button"), image = document.createElement("img");
      image.src = picture();
      image.alt = `the hand at ${goal.label}`;
      button.append(image, `${goal.label}, ${shown(goal.time)} s`);
      button.onclick = () => { seek(goal.time); frame.scrollIntoView({ block: "nearest" }); };
      strip.append(button);
    }
    seek(resume);
    inner("play").click();
  }
  open().catch(() => {
    const note = document.createElement("p");
    note.textContent = "This browser cannot unpack the scene; a newer one can, and viewer.html beside this file needs no unpacking.";
    frame.replaceWith(note);
  });
})();
