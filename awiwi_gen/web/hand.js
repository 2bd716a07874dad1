/* The page's hand: sliders give joint angles, generated kernels give poses and numbers, and both are shown. */
"use strict";

const DEGREES = 180 / Math.PI;
const SLOWER = 4; // times, than a finger falls
const FALLING = 1.5; // s
const FREE = 1e-9; // of the largest compliance: what moves less than this share does not move
const $ = (id) => document.getElementById(id);

class Hand {
  constructor(scene, kernels) {
    Object.assign(this, { scene, kernels });
    this.view = new View($("view"), scene.reach);
    this.view.redraw = () => this.draw();
    this.groups = [...(scene.wrist ? [{ name: "wrist", ...scene.wrist }] : []), ...scene.fingers];
    this.q = Object.fromEntries(this.groups.map((group) => [group.name, [...group.middle]]));
    this.sliders = [...document.querySelectorAll(".slider input[data-group]")];
    $("drop").disabled = !scene.fingers.every((finger) => this.has(finger, "forward_dynamics") && this.has(finger, "mass_matrix"));
    this.listen();
    this.refresh();
    this.view.lookAt([[0, 0, 0], ...this.extremes()]);
    this.draw();
  }

  finger() {
    return this.scene.fingers.find((finger) => finger.name === $("shown").value);
  }

  call(finger, family, ...inputs) {
    return this.kernels[`${finger.name}_${family}`](...inputs);
  }

  has(finger, family) {
    return `${finger.name}_${family}` in this.kernels;
  }

  /* Set a joint's angle [rad], or the place of one that slides [m], within its range. */
  set(group, joint, value) {
    const { low, high } = this.groups.find((each) => each.name === group).joints[joint];
    this.q[group][joint] = Math.min(Math.max(value, low), high);
    this.refresh();
  }

  listen() {
    for (const slider of this.sliders) {
      const { group, joint, scale } = slider.dataset;
      slider.addEventListener("input", () => {
        this.stop();
        this.set(group, Number(joint), Number(slider.value) / Number(scale));
      });
      slider.addEventListener("focus", () => this.choose(group));
    }
    for (const each of document.querySelectorAll("details.group")) {
      each.addEventListener("toggle", () => each.open && this.choose(each.dataset.group));
    }
    $("shown").addEventListener("change", () => this.refresh());
    $("tension").addEventListener("input", () => this.refresh());
    $("drop").addEventListener("click", () => (this.falls ? this.stop() : this.drop()));
    $("middle").addEventListener("click", () => {
      this.stop();
      for (const group of this.groups) this.q[group.name] = [...group.middle];
      this.view.reset();
      this.refresh();
    });
    new ResizeObserver(() => this.draw()).observe($("view"));
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.draw());
  }

  choose(name) {
    if (name === "wrist" || $("shown").value === name) return;
    $("shown").value = name;
    this.refresh();
  }

  /* ---- motion ---- */

  /* Where the palm is in the forearm, and a finger's base frame. */
  palm() {
    const { wrist } = this.scene;
    const pose = wrist && this.kernels[wrist.kernel];
    if (!pose) return identity(4);
    const inputs = wrist.bars ? this.q.wrist.map((angle) => [angle]) : [this.q.wrist];
    return rowsOf(pose(...inputs).T, 4);
  }

  base(finger) {
    return times(this.palm(), finger.base);
  }

  /* Gravity in a finger's base frame: down in the forearm's. */
  gravity(finger) {
    return turnedBack(this.base(finger), [0, 0, -this.scene.gravity]);
  }

  drop() {
    this.falls = this.scene.fingers.map((finger) => new Fall(this.kernels, finger, this.q[finger.name], this.gravity(finger)));
    $("drop").textContent = "Hold it";
    let [before, time] = [performance.now(), 0];
    const frame = (now) => {
      if (!this.falls) return;
      const passed = Math.min(Math.max(now - before, 0) / 1000, 0.04) / SLOWER;
      before = now;
      time += passed;
      for (const fall of this.falls) {
        fall.run(passed);
        this.q[fall.finger.name] = fall.q.map((x, i) => Math.min(Math.max(x, fall.finger.joints[i].low), fall.finger.joints[i].high));
      }
      this.refresh();
      if (time > FALLING) this.stop();
      else requestAnimationFrame(frame);
    };
    $("told").textContent = `falling, shown ${SLOWER} times slower`;
    requestAnimationFrame(frame);
  }

  stop() {
    if (!this.falls) return;
    this.falls = null;
    $("drop").textContent = "Drop it";
    $("told").textContent = "held";
  }

  /* ---- picture ---- */

  poses(finger, q = this.q[finger.name]) {
    const base = this.base(finger);
    const found = rowsOf(this.call(finger, "link_poses", q).T, 16);
    return [base, ...found.map((pose) => times(base, rowsOf(pose, 4)))];
  }

  /* Where the base, the joints and the tip are. */
  points(finger, q) {
    const poses = this.poses(finger, q);
    return [...poses.map((pose) => posed(pose, [0, 0, 0])), posed(poses[poses.length - 1], finger.tip)];
  }

  /* The same in the middle, and with each joint and all joints at both ends of their ranges. */
  extremes() {
    return this.scene.fingers.flatMap((finger) => {
      const { joints, middle } = finger;
      const poses = ["low", "high"].flatMap((end) => [
        joints.map((joint) => joint[end]),
        ...joints.map((_, moved) => middle.map((x, i) => (i === moved ? joints[i][end] : x))),
      ]);
      return [middle, ...poses].flatMap((q) => this.points(finger, q));
    });
  }

  draw() {
    const { view } = this;
    view.begin();
    this.drawPalm();
    for (const finger of this.scene.fingers) this.drawFinger(finger, finger === this.finger());
    view.end();
  }

  drawPalm() {
    const { view, scene } = this;
    const palm = this.palm();
    const [ink, soft] = [view.colour("soft"), view.colour("line")];
    const bases = scene.fingers.map((finger) => posed(this.base(finger), [0, 0, 0]));
    const middle = posed(palm, [0, 0, 0]);
    view.area([middle, ...bases, middle], soft);
    for (const base of bases) view.line([middle, base], soft, 3);
    const bars = scene.wrist?.bars;
    if (!bars || !this.kernels.wrist_points) return;
    const { A, B, C } = this.kernels.wrist_points(...this.q.wrist.map((angle) => [angle]));
    [A, B, C].forEach((end, index) => view.bone(bars[index], end, 0.02 * scene.reach, view.colour("bone"), ink));
    view.line([A, B, C, A, middle], ink, 2);
    view.line([...bars, bars[0]], soft, 2, { dash: [4, 4] });
  }

  drawFinger(finger, chosen) {
    const { view } = this;
    const poses = this.poses(finger);
    const points = this.points(finger).slice(1);
    const [bone, ink] = [view.colour(chosen ? "chosen" : "bone"), view.colour("soft")];
    finger.links.forEach((link, index) => {
      if (Math.hypot(...points[index].map((x, i) => x - points[index + 1][i])) > 1e-9) {
        view.bone(points[index], points[index + 1], link.width, bone, ink);
      }
      if (link.radius) view.circle(poses[index + 1], link.radius, ink, 1.2, { lift: 0.5 * link.radius });
    });
    for (const tendon of finger.tendons) {
      const colour = view.colour(tendon.returns ? "string" : "tendon");
      for (const line of tendon.lines) {
        view.line(line.map(([link, at]) => posed(poses[link + 1], at)), colour, chosen ? 1.6 : 1, { lift: 0.003 });
      }
    }
    view.text(this.above(points[points.length - 1]), finger.name, view.colour("text"));
    if (chosen && this.compliance?.[0].value > 0) this.drawCompliance(finger, points[points.length - 1]);
  }

  above(place) {
    return [place[0], place[1], place[2] + 0.06 * this.scene.reach];
  }

  /* Where 1 N from any direction moves the tip, enlarged to a size that can be seen. */
  drawCompliance(finger, tip) {
    const base = this.base(finger);
    const turned = (v) => [0, 1, 2].map((i) => base[i][0] * v[0] + base[i][1] * v[1] + base[i][2] * v[2]);
    const enlarged = enlargement(0.16 * this.scene.reach / this.compliance[0].value);
    const axes = this.compliance.map(({ value, vector }) => turned(vector).map((x) => x * value * enlarged));
    this.view.ellipsoid(tip, axes, this.view.colour("accent"));
    $("enlarged").textContent = `The ellipsoid at its tip is where 1 N from any direction moves it, ${enlargedBy(enlarged)}.`;
  }

  /* ---- numbers ---- */

  refresh() {
    for (const slider of this.sliders) {
      const { group, joint, scale, unit } = slider.dataset;
      const shown = this.q[group][Number(joint)] * Number(scale);
      if (document.activeElement !== slider || Math.abs(Number(slider.value) - shown) > 1e-6) slider.value = shown;
      slider.setAttribute("aria-valuetext", `${shown.toFixed(1)} ${unit === "°" ? "degrees" : unit}`);
      slider.nextElementSibling.textContent = `${shown.toFixed(1)}${unit === "°" ? "" : "\u00a0"}${unit}`;
    }
    const tension = Number($("tension").value);
    $("tension").nextElementSibling.textContent = `${tension.toPrecision(3)}\u00a0N`;
    $("tension").setAttribute("aria-valuetext", `${tension.toPrecision(3)} newtons`);
    const finger = this.finger();
    const q = this.q[finger.name];
    this.stiffness = this.stiffnessOf(finger, q, tension);
    const { T, J } = this.call(finger, "pose_and_jacobian", q);
    const speeds = rowsOf(J, q.length).slice(0, 3);
    this.compliance = this.complianceOf(speeds);
    fill("tip", this.tipRows(finger, posed(this.base(finger), [T[3], T[7], T[11]]), speeds));
    fill("joints", this.jointRows(finger, q));
    fill("tendons", this.tendonRows(finger, q));
    for (const cell of document.querySelectorAll("[data-joint-name]")) cell.remove();
    for (const joint of finger.joints) {
      const cell = document.createElement("th");
      cell.scope = "col";
      cell.dataset.jointName = cell.textContent = joint.name;
      $("tendons").previousElementSibling.rows[0].append(cell);
    }
    $("enlarged").textContent = "";
    this.draw();
  }

  /* The joint stiffness with one tension in every tendon; null without tendons. */
  stiffnessOf(finger, q, tension) {
    if (!finger.pulled.length || !this.has(finger, "joint_stiffness") || !this.has(finger, "tendon_stiffness")) return null;
    const f = finger.pulled.map(() => tension);
    const { k } = this.call(finger, "tendon_stiffness", f);
    return rowsOf(this.call(finger, "joint_stiffness", q, f, k).K, q.length);
  }

  /* Directions in which the tip gives way, and how far per newton, the softest first; null where joints are free. */
  complianceOf(speeds) {
    const soft = this.stiffness && inverse(this.stiffness);
    return soft && eigen(times(times(speeds, soft), transposed(speeds)));
  }

  tipRows(finger, place, speeds) {
    const sizes = eigen(times(speeds, transposed(speeds))).map(({ value }) => Math.sqrt(Math.max(value, 0)));
    const used = sizes.slice(0, finger.joints.length);
    const most = this.compliance?.[0].value;
    const stiff = this.compliance?.map(({ value }) => (value > FREE * most ? `${(1e-3 / value).toPrecision(3)}\u00a0N/mm` : "none moves it"));
    const slides = finger.joints.some((joint) => joint.slides);
    const speed = (size) => (slides ? size.toPrecision(3) : `${(1e3 * size).toFixed(1)}\u00a0mm/rad`);
    const unit = slides ? "in SI units" : `(m/rad)${["", "", "²", "³"][used.length]}`;
    return [
      ["place of the tip, x, y, z", place.map((x) => `${fixed(1e3 * x, 2)}\u00a0mm`).join(", ")],
      [`speed of the tip per speed of the joints${slides ? ", in SI units" : ""}`, used.map(speed).join(", ")],
      ["manipulability, their product", `${used.reduce((a, b) => a * b, 1).toExponential(3)}\u00a0${unit}`],
      ["stiffness of the tip, along its principal axes", stiff ? stiff.join(", ") : "none: the tendons leave a joint free"],
    ];
  }

  jointRows(finger, q) {
    const hold = this.has(finger, "gravity") ? this.call(finger, "gravity", q, this.gravity(finger)).gravity : [];
    return finger.joints.map((joint, i) => {
      const unit = joint.slides ? ["mm", 1e3, "N/m", "mN"] : ["°", DEGREES, "N\u00a0m/rad", "mN\u00a0m"];
      return [
        joint.name,
        `${fixed(q[i] * unit[1], 2)}${joint.slides ? "\u00a0" : ""}${unit[0]}`,
        this.stiffness ? `${this.stiffness[i][i].toPrecision(4)}\u00a0${unit[2]}` : "-",
        hold.length ? `${fixed(1e3 * hold[i], 2)}\u00a0${unit[3]}` : "-",
      ];
    });
  }

  tendonRows(finger, q) {
    if (!finger.pulled.length || !this.has(finger, "coupling")) return [];
    const P = rowsOf(this.call(finger, "coupling", q).P, q.length);
    const lengths = this.lengths(finger, q);
    return P.map((row, i) => [String(i), `${fixed(1e3 * lengths[i], 3)}\u00a0mm`, ...row.map((arm, j) => fixed((finger.joints[j].slides ? 1 : 1e3) * arm, 2))]);
  }

  /* Lengths of a finger's tendons [m], with their way through the wrist. */
  lengths(finger, q) {
    const { fingers, wrist } = this.scene;
    if (!wrist?.bars || !this.kernels.hand_tendon_lengths) return this.call(finger, "tendon_lengths", q).h;
    const before = fingers.slice(0, fingers.indexOf(finger)).reduce((sum, each) => sum + each.pulled.length, 0);
    const all = this.kernels.hand_tendon_lengths(fingers.flatMap((each) => this.q[each.name]), this.q.wrist).h;
    return all.slice(before, before + finger.pulled.length);
  }
}

/* A number with so many decimals; no zero has a sign. */
const fixed = (x, decimals) => x.toFixed(decimals).replace(/^-(0\.?0*)$/, "$1");

/* The round number below one. */
function enlargement(most) {
  const power = 10 ** Math.floor(Math.log10(most));
  return power * [5, 2, 1].find((digit) => digit * power <= most);
}

const enlargedBy = (x) => (x === 1 ? "true to scale" : x > 1 ? `enlarged ${x} times` : `at 1/${Math.round(1 / x)} of its size`);

/* Fill the body of a table. */
function fill(id, rows) {
  $(id).replaceChildren(...rows.map((cells) => {
    const row = document.createElement("tr");
    cells.forEach((text, index) => {
      const cell = document.createElement(index ? "td" : "th");
      if (!index) cell.scope = "row";
      cell.textContent = text;
      row.append(cell);
    });
    return row;
  }));
}

globalThis.ready = (async () => {
  const { scene, module } = JSON.parse($("scene").textContent);
  globalThis.hand = new Hand(scene, await loadKernels(module, scene.kernels));
})();
