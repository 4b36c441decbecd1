"use strict";
// The scene, and what can be done with it: `stage` is what the controls act on, here or from a page around this one.
const design = JSON.parse(document.getElementById("design").textContent);
const viewer = new MeshCat.Viewer(document.getElementById("meshcat-pane"));
for (const command of design.commands) {
  viewer.handle_command_bytearray(Uint8Array.from(atob(command), (c) => c.charCodeAt(0)));
}
const stage = { span: design.span, samples: design.samples, layers: design.layers, views: design.views,
  start: design.start, radius: design.radius, viewer, window };

// One lamp over the camera's shoulder that casts shadows, little light from elsewhere; directions are in meshcat's
// scene, z up.
function light() {
  const part = (...path) => viewer.scene_tree.find([...path, "<object>"]).object;
  for (const name of ["Grid", "Axes"]) viewer.set_property([name], "visible", false);
  for (const name of ["PointLightNegativeX", "PointLightPositiveX"]) {
    viewer.set_property(["Lights", name], "visible", false);
  }
  viewer.set_property(["Lights", "SpotLight"], "visible", true);
  const [x, y, z] = design.views[0].eye;
  const lamp = part("Lights", "SpotLight"), fill = part("Lights", "FillLight");
  lamp.position.set(3 * x - 2 * y, 3 * y + 2 * x, 3 * z + 3.5);
  lamp.angle = 0.6;
  lamp.penumbra = 0.5;
  lamp.intensity = 0.45;
  lamp.castShadow = true;
  lamp.shadow.mapSize.set(2048, 2048);
  lamp.shadow.radius = 3;
  lamp.shadow.camera.far = 12;
  fill.position.set(x + y, y - x, z);
  fill.intensity = 0.22;
  part("Lights", "AmbientLight").intensity = 0.62;
  viewer.scene.traverse((item) => {
    if (item.material && item.material.transparent) item.castShadow = false;
  });
}
light();

// A light ground and sky, or a dark one, as the system has it.
const dark = matchMedia("(prefers-color-scheme: dark)");
function sky() {
  viewer.set_property(["Background"], "top_color", dark.matches ? [0.08, 0.095, 0.11] : [1, 1, 1]);
  viewer.set_property(["Background"], "bottom_color", dark.matches ? [0.15, 0.18, 0.21] : [0.85, 0.88, 0.92]);
  if (design.ground) {
    viewer.scene_tree.find(design.ground).object.traverse(({ material }) => {
      if (!material) return;
      material.userData.light ??= material.color.clone();
      material.color.copy(material.userData.light).multiplyScalar(dark.matches ? 0.42 : 1);
    });
  }
  viewer.set_dirty();
}
sky();
dark.addEventListener("change", sky);

// The scene fits in a ball of radius 1 about the origin: stand where the ball, or one so many times as large, fills the
// narrower side of the window above what stands at its bottom.
let seen = design.views[0].eye, share = 1, stood = null, below = () => 0;
function look(eye) {
  seen = eye;
  const fieldOfView = 32, [width, height, taken] = [window.innerWidth, window.innerHeight, below()];
  const halfAngle = Math.atan(Math.tan(fieldOfView * Math.PI / 360) * Math.min(width, height - taken) / height);
  const [x, y, z] = eye.map((part) => part * share * 1.02 / Math.sin(halfAngle));
  viewer.camera.setViewOffset(width, height, 0, taken / 2, width, height);
  viewer.camera.fov = fieldOfView;
  viewer.camera.near = 0.05;
  viewer.camera.position.set(x, z, -y);  // meshcat's camera has y up
  viewer.controls.target.set(0, 0, 0);
  viewer.controls.update();
  stood = viewer.camera.position.clone();
  viewer.set_dirty();
}
look(seen);
// Unless it was turned by hand, it fills the window when that changes, too.
window.addEventListener("resize", () => { if (viewer.camera.position.distanceTo(stood) < 1e-6) look(seen); });
stage.look = (name) => {
  const view = stage.views.find((each) => each.name === name);
  if (view) look(view.eye);
};
stage.above = (taken) => { below = taken; look(seen); };
stage.fit = (times) => { share = times; look(seen); };
stage.turned = (follow) => viewer.controls.addEventListener("change", () => {
  follow(viewer.camera.position.toArray(), viewer.controls.target.toArray(), share);
});
stage.turn = (position, target, times) => {
  viewer.camera.position.fromArray(position).multiplyScalar(share / times);
  viewer.controls.target.fromArray(target).multiplyScalar(share / times);
  viewer.controls.update();
  viewer.set_dirty();
};

stage.show = (time) => viewer.animator.seek(Math.min(time, design.span[1]));
stage.layer = (name, on) => {
  const layer = design.layers.find((each) => each.name === name);
  for (const path of layer ? layer.paths : []) viewer.scene_tree.find(path).set_property("visible", on);
  viewer.set_dirty();
};
// What is drawn over all else, and what is seen through already, stays as it is.
stage.seeThrough = (on) => {
  viewer.scene_tree.find(design.hand).object.traverse((item) => {
    if (!item.isMesh || item.renderOrder) return;
    item.material.transparent = on;
    item.material.opacity = on ? 0.35 : 1;
    item.material.needsUpdate = true;
  });
  viewer.set_dirty();
};
if (design.span[1] > design.span[0]) {
  // meshcat's own controls of the animation sit in a folded panel; a button and a slider do better.
  viewer.gui.removeFolder(viewer.animator.folder);
  viewer.animator.play();   // activates the tracks ...
  viewer.animator.pause();  // ... but the time is kept by the controls
}

// Names beside what they name, where that is in the window now; names that would cover each other stand in a row.
function name() {
  const named = design.labels.map(({path, text, color}) => {
    const label = document.body.appendChild(document.createElement("div"));
    label.className = "label";
    label.textContent = text;
    label.style.setProperty("--color", color);
    return {label, item: viewer.scene_tree.find(path).object};
  });
  function place() {
    const placed = [];
    for (const {label, item} of named) {
      const at = item.getWorldPosition(viewer.camera.position.clone()).project(viewer.camera);
      const [x, wanted] = [(at.x + 1) / 2 * window.innerWidth + 9, (1 - at.y) / 2 * window.innerHeight - 9];
      let y = wanted, shown = item;
      while (shown.visible && shown.parent) shown = shown.parent;
      while (placed.some((other) => Math.abs(other.y - y) < 17 && Math.abs(other.x - x) < other.width)) y += 17;
      if (shown.visible) placed.push({x, y, width: label.offsetWidth + 6});
      label.style.transform = `translate(${x}px, ${y}px)`;
      label.style.visibility = at.z < 1 && shown.visible ? "visible" : "hidden";
    }
    requestAnimationFrame(place);
  }
  place();
}
if (design.labels.length) name();
window.stage = stage;
