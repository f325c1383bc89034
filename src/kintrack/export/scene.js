// SPDX-License-Identifier: Apache-2.0
// The person, the observed points and the depth camera in a meshcat viewer. `packing.py` writes
// what is read here: a scene once, then frames. World frame: metres, z up.

function bytesOf(base64) {
  return Uint8Array.from(atob(base64), (c) => c.charCodeAt(0)).buffer;
}

class PersonScene {
  constructor(viewer, scene) {
    this.viewer = viewer;
    this.camera = scene.camera;
    const three = MeshCat.THREE;
    for (const end of ["top_color", "bottom_color"]) {
      viewer.set_property(["Background"], end, [0.13, 0.15, 0.19]);
    }
    viewer.set_property(["Axes"], "visible", false);
    viewer.set_object(["Grid"], new three.GridHelper(6, 12, 0x6b7483, 0x4a5160)
      .rotateX(Math.PI / 2));

    const skin = new three.BufferGeometry();
    const colors = new Uint8Array(bytesOf(scene.vertex_colors));
    skin.setAttribute("position", new three.BufferAttribute(new Float32Array(colors.length), 3));
    skin.setAttribute("color", new three.BufferAttribute(colors, 3, true));
    skin.setIndex(new three.BufferAttribute(new Uint32Array(bytesOf(scene.faces)), 1));
    this.skin = new three.Mesh(skin, new three.MeshLambertMaterial(
      {vertexColors: true, transparent: true, opacity: 0.85}));

    const cloud = new three.BufferGeometry();
    const room = 3 * scene.most_points;
    cloud.setAttribute("position", new three.BufferAttribute(new Float32Array(room), 3));
    cloud.setAttribute("color", new three.BufferAttribute(new Uint8Array(room), 3, true));
    this.cloud = new three.Points(cloud, new three.PointsMaterial(
      {size: 0.014, vertexColors: true}));

    const joints = new three.BufferGeometry();
    joints.setAttribute("position", new three.BufferAttribute(
      new Float32Array(3 * scene.joints), 3));
    this.joints = new three.Points(joints, new three.PointsMaterial(
      {size: 0.03, color: 0xffd23c, depthTest: false, transparent: true}));
    const bones = new three.BufferGeometry();
    bones.setAttribute("position", joints.attributes.position);
    bones.setIndex(scene.bones.flat());
    this.bones = new three.LineSegments(bones, new three.LineBasicMaterial(
      {color: 0xffffff, depthTest: false, transparent: true}));

    const frustum = new three.BufferGeometry();
    frustum.setAttribute("position", new three.BufferAttribute(
      new Float32Array(scene.frustum.flat()), 3));
    const outline = new three.LineSegments(frustum, new three.LineBasicMaterial(
      {color: 0x9aa4b2}));

    for (const [name, object] of [
      ["skin", this.skin], ["points", this.cloud], ["joints", this.joints],
      ["bones", this.bones], ["depth camera", outline]]) {
      object.frustumCulled = false;
      viewer.set_object(["Person", name], object);
    }
    this.looksAtPerson = false;
    const [x, y, z] = scene.camera, [ax, ay, az] = scene.axis;
    this.look([x + 2.5 * ax, y + 2.5 * ay, z + 2.5 * az]);
  }

  // Look at a point from 35 degrees beside the depth camera, a little from above.
  look(target) {
    const dx = this.camera[0] - target[0], dy = this.camera[1] - target[1];
    const angle = Math.atan2(dy, dx) + 35 * Math.PI / 180;
    const distance = Math.min(Math.max(Math.hypot(dx, dy), 2.6), 3.4);
    const eye = [target[0] + distance * Math.cos(angle),
                 target[1] + distance * Math.sin(angle), target[2] + 0.5];
    // meshcat's camera lives in a node turned by 90 degrees about x: (x, y, z) is (x, z, -y) there.
    this.viewer.camera.position.set(eye[0], eye[2], -eye[1]);
    this.viewer.camera.fov = 45;
    this.viewer.controls.target.set(target[0], target[2], -target[1]);
    this.viewer.set_dirty();
  }

  // Show one packed frame; returns its header.
  show(buffer) {
    const size = new DataView(buffer).getUint32(0, true);
    const header = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, size)));
    let start = 4 + size;
    const millimetres = (count) => {
      const values = new Int16Array(buffer, start, 3 * count);
      start += values.byteLength;
      return values;
    };
    const fill = (geometry, values) => {
      const position = geometry.attributes.position;
      for (let i = 0; i < values.length; i++) position.array[i] = 0.001 * values[i];
      position.needsUpdate = true;
    };

    this.skin.visible = header.vertices > 0;
    const vertices = millimetres(header.vertices);
    if (this.skin.visible) {
      fill(this.skin.geometry, vertices);
      this.skin.geometry.computeVertexNormals();
      if (!this.looksAtPerson) this.meet(vertices);
    }
    this.joints.visible = this.bones.visible = header.joints > 0;
    fill(this.joints.geometry, millimetres(header.joints));
    fill(this.cloud.geometry, millimetres(header.points));
    this.cloud.geometry.setDrawRange(0, header.points);
    const color = this.cloud.geometry.attributes.color;
    color.array.set(new Uint8Array(buffer, start, 3 * header.points));
    color.needsUpdate = true;
    if (header.vertex_colors > 0) {
      const paint = this.skin.geometry.attributes.color;
      start += 3 * header.points;
      paint.array.set(new Uint8Array(buffer, start, 3 * header.vertex_colors));
      paint.needsUpdate = true;
    }
    this.viewer.set_dirty();
    return header;
  }

  // The person's first sight: turn to the person and put the grid below the feet.
  meet(vertices) {
    const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
    vertices.forEach((value, i) => {
      low[i % 3] = Math.min(low[i % 3], 0.001 * value);
      high[i % 3] = Math.max(high[i % 3], 0.001 * value);
    });
    const middle = low.map((value, k) => (value + high[k]) / 2);
    this.look(middle);
    this.viewer.set_property(["Grid"], "position", [middle[0], middle[1], low[2]]);
    this.looksAtPerson = true;
  }
}

function describe(header) {
  const label = document.getElementById("label");
  label.firstElementChild.textContent = header.status;
  label.firstElementChild.style.background = header.color;
  label.lastElementChild.textContent = `frame ${header.index}  ${header.text}`;
}

// Recorded frames, by their time stamps, over and over.
function play(person, frames) {
  const button = document.getElementById("play"), slider = document.getElementById("time");
  const end = frames.length - 1, first = frames[0].time_s;
  let shown = -1, playing = true, started = performance.now();
  slider.max = end;
  const show = (k) => {
    if (k !== shown) describe(person.show(bytesOf(frames[k].data)));
    slider.value = shown = k;
  };
  const resumeFrom = (k) => {
    started = performance.now() - 1000 * (frames[k].time_s - first);
  };
  const tick = () => {
    if (playing) {
      const time_s = first + (performance.now() - started) / 1000;
      let k = Math.max(shown, 0);
      while (k < end && frames[k + 1].time_s <= time_s) k++;
      show(k);
      if (k === end && time_s > frames[end].time_s + 0.5) {
        shown = -1;
        resumeFrom(0);
      }
    }
    requestAnimationFrame(tick);
  };
  const setPlaying = (value) => {
    playing = value;
    button.textContent = playing ? "pause" : "play";
    if (playing) resumeFrom(Math.max(shown, 0));
  };
  button.onclick = () => setPlaying(!playing);
  slider.oninput = () => {
    setPlaying(false);
    show(Number(slider.value));
  };
  tick();
}

// Live frames: each answer asks for the newest one, so that a slow browser never lags behind.
function follow(viewer) {
  const socket = new WebSocket(`ws://${location.host}/frames`);
  let person = null;
  socket.binaryType = "arraybuffer";
  socket.onmessage = (message) => {
    if (typeof message.data === "string") {
      person = new PersonScene(viewer, JSON.parse(message.data));
      socket.send("ready");
    } else {
      describe(person.show(message.data));
      requestAnimationFrame(() => socket.send("ready"));
    }
  };
  socket.onclose = () => describe({status: "ended", color: "#666", index: "", text: ""});
}
