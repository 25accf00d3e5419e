// Draws messages of the stream with three, seen by a camera that goes round.
import { BLOCK, FLAG, KIND, ROLE } from './stream.js';

// Normals come as two bytes of an octahedron's map, in the fourth number of each vertex.
const OCT_DECLARATION = 'attribute float oct;\nattribute float film;\nvarying float filmOf;\n';
// A film is as dark as liquid of its depth: half of the light is absorbed in 0.35 mm. It is smooth.
const FILM_COLOR = `
#include <color_fragment>
  float filmCover = 1.0 - exp(-filmOf * 2.55e-3 / 0.5e-3);
  diffuseColor.rgb = mix(diffuseColor.rgb, filmColor, mix(1.0, filmCover, diffuseColor.a));
  diffuseColor.a = mix(diffuseColor.a, 1.0, filmCover);
`;
const FILM_ROUGHNESS = `
#include <roughnessmap_fragment>
  roughnessFactor = mix(roughnessFactor, 0.12, filmCover);
`;
const OCT_NORMAL = `
  float octV = floor(oct / 256.0), octU = oct - 256.0 * octV;
  vec2 octUV = vec2(octU - (octU > 127.0 ? 256.0 : 0.0), octV - (octV > 127.0 ? 256.0 : 0.0)) / 127.0;
  vec3 objectNormal = vec3(octUV, 1.0 - abs(octUV.x) - abs(octUV.y));
  float octFold = max(-objectNormal.z, 0.0);
  objectNormal.xy += vec2(objectNormal.x >= 0.0 ? -octFold : octFold, objectNormal.y >= 0.0 ? -octFold : octFold);
  objectNormal = normalize(objectNormal);
`;
const LOOKS = { [ROLE.real]: [0.6, 0], [ROLE.body]: [0.38, 0], [ROLE.obstacle]: [0.6, 0], [ROLE.blade]: [0.25, 0.1] };  // roughness, metalness

export class Viewer {
  constructor(THREE, canvas) {
    this.THREE = THREE;
    this.canvas = canvas;
    this.renderer = new THREE.WebGLRenderer({ canvas, antialias: true, powerPreference: 'high-performance', preserveDrawingBuffer: true });
    this.renderer.shadowMap.enabled = true;
    this.renderer.shadowMap.type = THREE.PCFSoftShadowMap;
    this.scene = new THREE.Scene();
    this.scene.background = new THREE.Color(0xd9dde2);
    this.stage = new THREE.Group();  // the world; moved as a whole in VR
    this.scene.add(this.stage);
    this.camera = new THREE.PerspectiveCamera(40, 1, 0.005, 60);
    this.things = new Map();
    this.hidden = new Set();
    this.box = new THREE.Box3();
    this.view = { azimuth: 30, elevation: 25, distance: 1.5, target: new THREE.Vector3(0, 0.3, 0) };
    this.asked = {};
    this.isFitted = false;
    this.addLights();
    addOrbit(this);
    new ResizeObserver(() => this.resize()).observe(canvas);
    this.resize();
    this.slow = 0;
    this.onFrame = null;
    this.onDrawn = null;  // after each picture
    this.renderer.setAnimationLoop((time, xrFrame) => this.draw(xrFrame));
  }

  addLights() {
    const { THREE, stage } = this;
    stage.add(new THREE.HemisphereLight(0xffffff, 0x9aa0a8, 2.1));
    this.sun = new THREE.DirectionalLight(0xffffff, 2.2);
    this.sun.castShadow = true;
    this.sun.shadow.mapSize.set(1024, 1024);
    this.sun.shadow.bias = -0.0005;
    this.sun.shadow.normalBias = 0.002;
    stage.add(this.sun, this.sun.target);
    const ground = new THREE.Mesh(new THREE.PlaneGeometry(6, 6), new THREE.ShadowMaterial({ opacity: 0.28 }));
    ground.rotation.x = -Math.PI / 2;
    ground.receiveShadow = true;
    const grid = new THREE.GridHelper(6, 60, 0xa3abb4, 0xc1c7ce);
    grid.position.y = -0.0005;
    stage.add(ground, grid);
  }

  resize() {
    const w = this.canvas.clientWidth || 1, h = this.canvas.clientHeight || 1;
    if (this.renderer.xr.isPresenting) return;
    this.renderer.setPixelRatio(Math.min(window.devicePixelRatio || 1, 2));
    this.renderer.setSize(w, h, false);
    this.camera.aspect = w / h;
    this.camera.updateProjectionMatrix();
    this.changed = true;
  }

  // Shows a message; things of a kind that it lacks go.
  show(message) {
    const seen = new Set();
    for (const block of message.blocks) {
      if (block.kind === BLOCK.json || block.kind > BLOCK.json) continue;
      let key = `${message.kind}/${block.kind}/${block.role}/${block.name}`;
      while (seen.has(key)) key += '+';
      seen.add(key);
      let thing = this.things.get(key);
      if (!thing) this.things.set(key, thing = this.make(block));
      this.fill(thing, block);
    }
    for (const [key, thing] of this.things)
      if (key.startsWith(`${message.kind}/`)) thing.object.visible = seen.has(key) && !this.hidden.has(thing.role);
    if (message.kind === KIND.frame && !this.isFitted) this.fit();
    this.changed = true;
  }

  make(block) {
    const { THREE } = this;
    const geometry = new THREE.BufferGeometry(), color = new THREE.Color().setRGB(...block.color, THREE.SRGBColorSpace);
    let object;
    if (block.kind === BLOCK.surface) {
      const [roughness, metalness] = LOOKS[block.role] ?? [0.6, 0];
      const material = new THREE.MeshStandardMaterial({ color, roughness, metalness, side: THREE.DoubleSide, transparent: block.opacity < 1, opacity: block.opacity, depthWrite: block.opacity === 1 });
      if (block.flags & FLAG.normals)
        material.onBeforeCompile = (shader) => {
          shader.vertexShader = OCT_DECLARATION + shader.vertexShader.replace('#include <beginnormal_vertex>', `${OCT_NORMAL}filmOf = film;\n`);
          shader.uniforms.filmColor = { value: new THREE.Color().setRGB(0.45, 0.02, 0.04, THREE.SRGBColorSpace) };
          shader.fragmentShader = `varying float filmOf;\nuniform vec3 filmColor;\n${shader.fragmentShader}`
            .replace('#include <color_fragment>', FILM_COLOR).replace('#include <roughnessmap_fragment>', FILM_ROUGHNESS);
        };
      else material.flatShading = true;
      material.customProgramCacheKey = () => (block.flags & FLAG.normals ? 'oct' : 'flat');
      object = new THREE.Mesh(geometry, material);
      object.castShadow = block.opacity === 1;
      object.receiveShadow = true;
    } else if (block.kind === BLOCK.lines) {
      object = new THREE.LineSegments(geometry, new THREE.LineBasicMaterial({ color }));
    } else {
      object = new THREE.Points(geometry, this.dropMaterial(color));
    }
    object.frustumCulled = false;
    object.matrixAutoUpdate = false;
    this.stage.add(object);
    return { object, role: block.role, name: block.name, kind: block.kind, vertices: null, indices: null };
  }

  dropMaterial(color) {
    return new this.THREE.ShaderMaterial({
      uniforms: { color: { value: color }, size_m: { value: this.dropSize_m ?? 0.005 }, height_px: { value: 720 } },
      vertexShader: `uniform float size_m, height_px; void main() { vec4 p = modelViewMatrix * vec4(position, 1.0); gl_Position = projectionMatrix * p;
        gl_PointSize = max(2.0, size_m * height_px * projectionMatrix[1][1] / -p.z * 0.5); }`,
      fragmentShader: `uniform vec3 color; void main() { vec2 q = 2.0 * gl_PointCoord - 1.0; float r = dot(q, q); if (r > 1.0) discard;
        float light = 0.35 + 0.65 * max(0.0, dot(vec3(q.x, -q.y, sqrt(1.0 - r)), vec3(-0.4, 0.7, 0.6)));
        gl_FragColor = vec4(color * light, 1.0);
#include <colorspace_fragment>
      }`,
    });
  }

  // Buffers grow; where a mesh has fewer vertices than before, the rest isn't drawn.
  fill(thing, block) {
    const { THREE } = this, { object } = thing, geometry = object.geometry;
    if (!thing.vertices || thing.vertices.array.length < block.vertices.length) {
      const capacity = thing.vertices ? Math.ceil(block.vertices.length / 4 * 1.25) * 4 : block.vertices.length;
      if (thing.vertices) geometry.dispose();
      thing.vertices = new THREE.InterleavedBuffer(new Uint16Array(capacity), 4).setUsage(THREE.DynamicDrawUsage);
      geometry.setAttribute('position', new THREE.InterleavedBufferAttribute(thing.vertices, 3, 0, false));
      geometry.setAttribute('oct', new THREE.InterleavedBufferAttribute(thing.vertices, 1, 3, false));
    }
    thing.vertices.array.set(block.vertices);
    thing.vertices.needsUpdate = true;
    if (block.kind === BLOCK.surface) this.fillFilm(thing, block);
    let drawn = block.count;
    if (block.kind === BLOCK.surface) {
      if (!(block.flags & FLAG.sameTriangles)) this.fillTriangles(thing, block);
      drawn = thing.corners;
      object.material.color.setRGB(...block.color, THREE.SRGBColorSpace);
    }
    geometry.setDrawRange(0, drawn);
    geometry.boundingSphere = null;
    const s = block.step, [x, y, z] = block.origin;
    object.matrix.set(s, 0, 0, x, 0, s, 0, y, 0, 0, s, z, 0, 0, 0, 1);
    object.matrixWorldNeedsUpdate = true;
    thing.block = { origin: block.origin, step: block.step, count: block.count };
    thing.extent = extentOf(block);
  }

  // Where a vertex of a thing is in the world.
  vertex(thing, v) {
    const { origin, step } = thing.block, q = thing.vertices.array;
    return new this.THREE.Vector3(...origin.map((x, a) => x + step * q[4 * v + a]));
  }

  // Of each vertex, 0 (dry) to 1 (2.55 mm).
  fillFilm(thing, block) {
    const size = thing.vertices.array.length / 4, geometry = thing.object.geometry;
    if (!thing.film || thing.film.array.length !== size) {
      thing.film = new this.THREE.BufferAttribute(new Uint8Array(size), 1, true).setUsage(this.THREE.DynamicDrawUsage);
      geometry.setAttribute('film', thing.film);
    }
    if (!block.film && !thing.isWet) return;
    block.film ? thing.film.array.set(block.film) : thing.film.array.fill(0);
    thing.isWet = Boolean(block.film);
    thing.film.needsUpdate = true;
  }

  fillTriangles(thing, block) {
    const { THREE } = this, geometry = thing.object.geometry;
    const old = thing.indices;
    if (thing.filled === block.indices) return;
    thing.filled = block.indices;
    if (!old || old.array.length < block.indices.length || old.array.constructor !== block.indices.constructor) {
      const capacity = old ? Math.ceil(block.indices.length * 1.25) : block.indices.length;
      if (old) geometry.dispose();
      thing.indices = new THREE.BufferAttribute(new block.indices.constructor(capacity), 1).setUsage(THREE.DynamicDrawUsage);
      geometry.setIndex(thing.indices);
    }
    thing.indices.array.set(block.indices);
    thing.indices.needsUpdate = true;
    thing.corners = block.indices.length;
  }

  // Everything that isn't a camera fills the picture, unless the scene says from where it is seen.
  fit(contents = true) {
    const { THREE, box } = this;
    box.makeEmpty();
    for (const thing of this.things.values()) {
      if (!thing.extent || thing.role === ROLE.camera || thing.role === ROLE.box) continue;
      box.expandByPoint(new THREE.Vector3(...thing.extent.min)).expandByPoint(new THREE.Vector3(...thing.extent.max));
    }
    if (box.isEmpty()) return;
    this.isFitted = contents;
    const sphere = box.getBoundingSphere(new THREE.Sphere()), asked = this.asked;
    this.camera.fov = asked.field_of_view_deg ?? 40;
    this.camera.updateProjectionMatrix();
    const view = this.view;
    view.azimuth = asked.azimuth_deg ?? 30;
    view.elevation = asked.elevation_deg ?? 25;
    view.target.copy(asked.target_m ? new THREE.Vector3(...asked.target_m) : sphere.center);
    view.distance = asked.distance_m ?? Math.max(0.05, 1.15 * sphere.radius / Math.sin(this.camera.fov * Math.PI / 360));
    if (asked.eye_m) {
      const offset = new THREE.Vector3(...asked.eye_m).sub(view.target);
      view.distance = offset.length();
      view.azimuth = Math.atan2(offset.x, offset.z) * 180 / Math.PI;
      view.elevation = Math.asin(offset.y / view.distance) * 180 / Math.PI;
    }
    const reach = Math.max(0.05, 1.3 * sphere.radius), sun = this.sun, light = sun.shadow.camera;
    sun.position.copy(sphere.center).add(new THREE.Vector3(-0.5, 0.9, 0.55).normalize().multiplyScalar(3 * reach));
    sun.target.position.copy(sphere.center);
    Object.assign(light, { left: -reach, right: reach, top: reach, bottom: -reach, near: reach, far: 3 * reach + sphere.center.y + 3 * reach });
    light.updateProjectionMatrix();
    this.changed = true;
  }

  hide(role, isHidden) {
    isHidden ? this.hidden.add(role) : this.hidden.delete(role);
    for (const thing of this.things.values()) if (thing.role === role) thing.object.visible = !isHidden;
    this.changed = true;
  }

  placeCamera() {
    const { azimuth, elevation, distance, target } = this.view, a = azimuth * Math.PI / 180, e = elevation * Math.PI / 180;
    this.camera.position.set(Math.sin(a) * Math.cos(e), Math.sin(e), Math.cos(a) * Math.cos(e)).multiplyScalar(distance).add(target);
    this.camera.near = Math.max(0.002, distance / 100);
    this.camera.far = 60 + distance;
    this.camera.updateProjectionMatrix();
    this.camera.lookAt(target);
  }

  // Draws the edges of boxes that belong to a side whose inside faces the eye: no other can be behind the contents.
  chooseEdges() {
    const eye = this.camera.getWorldPosition(new this.THREE.Vector3()).sub(this.stage.position).toArray();
    for (const thing of this.things.values()) {
      if (thing.role !== ROLE.box) continue;
      const q = thing.vertices.array, { origin, step, count } = thing.block;
      if (!thing.indices) thing.object.geometry.setIndex(thing.indices = new this.THREE.BufferAttribute(new Uint16Array(count), 1));
      const drawn = [];
      const point = (i) => origin.map((x, a) => x + step * q[4 * i + a]);
      for (let box = 0; box < count; box += 24) {
        const points = Array.from({ length: 24 }, (_, i) => point(box + i));
        const middle = [0, 1, 2].map((a) => points.reduce((sum, p) => sum + p[a], 0) / 24);
        for (let i = 0; i < 24; i += 2) {
          const isFar = [0, 1, 2].some((a) => {
            const outward = points[i][a] + points[i + 1][a] - 2 * middle[a];
            return Math.abs(outward) > 1e-6 && outward * (eye[a] - points[i][a]) < 0;
          });
          if (isFar) drawn.push(box + i, box + i + 1);
        }
      }
      thing.indices.array.set(drawn);
      thing.indices.needsUpdate = true;
      thing.object.geometry.setDrawRange(0, drawn.length);
    }
  }

  draw(xrFrame) {
    this.onFrame?.(xrFrame);
    const inVR = this.renderer.xr.isPresenting;
    if (!this.changed && !inVR) return;
    this.changed = false;
    if (!inVR) this.placeCamera();
    this.chooseEdges();
    const height = this.renderer.getDrawingBufferSize(new this.THREE.Vector2()).y;
    for (const thing of this.things.values())
      if (thing.kind === BLOCK.particles) Object.assign(thing.object.material.uniforms.height_px, { value: height });
    const begin = performance.now();
    this.renderer.render(this.scene, this.camera);
    this.onDrawn?.();
    // Software drivers draw shadows slowly: after ten pictures of more than 60 ms there are none.
    if (this.sun.castShadow) {
      this.slow = performance.now() - begin > 60 ? this.slow + 1 : 0;
      if (this.slow > 10) this.sun.castShadow = false;
    }
    this.drawn = (this.drawn ?? 0) + 1;
  }
}

function extentOf(block) {
  const min = [65535, 65535, 65535], max = [0, 0, 0], q = block.vertices;
  if (!block.count) return null;
  for (let i = 0; i < q.length; i += 4)
    for (let a = 0; a < 3; ++a) {
      const x = q[i + a];
      if (x < min[a]) min[a] = x;
      if (x > max[a]) max[a] = x;
    }
  const world = (s) => s.map((x, a) => block.origin[a] + block.step * x);
  return { min: world(min), max: world(max) };
}

// Left: round; right or shift: along; wheel: nearer. One finger: round; two: along and nearer.
function addOrbit(viewer) {
  const { canvas, view } = viewer, fingers = new Map();
  let spread = 0;
  const pan = (dx, dy) => {
    const scale = 2 * view.distance * Math.tan(viewer.camera.fov * Math.PI / 360) / canvas.clientHeight;
    const e = viewer.camera.matrixWorld.elements;
    view.target.x -= scale * (dx * e[0] - dy * e[4]);
    view.target.y -= scale * (dx * e[1] - dy * e[5]);
    view.target.z -= scale * (dx * e[2] - dy * e[6]);
  };
  canvas.addEventListener('pointerdown', (event) => {
    if (viewer.grab?.(event)) return;
    fingers.set(event.pointerId, { x: event.clientX, y: event.clientY });
    canvas.setPointerCapture(event.pointerId);
    spread = 0;
  });
  canvas.addEventListener('pointermove', (event) => {
    const last = fingers.get(event.pointerId);
    if (!last) return;
    const dx = event.clientX - last.x, dy = event.clientY - last.y;
    fingers.set(event.pointerId, { x: event.clientX, y: event.clientY });
    if (fingers.size === 2) {
      const [a, b] = [...fingers.values()], now = Math.hypot(a.x - b.x, a.y - b.y);
      if (spread > 0 && now > 0) view.distance *= spread / now;
      spread = now;
      pan(dx / 2, dy / 2);
    } else if (event.shiftKey || event.buttons & 2 || event.buttons & 4) {
      pan(dx, dy);
    } else {
      view.azimuth -= 0.4 * dx;
      view.elevation = Math.max(-89, Math.min(89, view.elevation + 0.4 * dy));
    }
    viewer.changed = true;
  });
  for (const end of ['pointerup', 'pointercancel']) canvas.addEventListener(end, (event) => fingers.delete(event.pointerId));
  canvas.addEventListener('wheel', (event) => {
    event.preventDefault();
    if (viewer.reach?.(event)) return;
    view.distance = Math.max(0.01, Math.min(50, view.distance * Math.exp(0.001 * event.deltaY)));
    viewer.changed = true;
  }, { passive: false });
  canvas.addEventListener('contextmenu', (event) => event.preventDefault());
}
