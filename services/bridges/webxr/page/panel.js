// What the page says in words.

const element = (id) => document.getElementById(id);

export class Panel {
  constructor() {
    this.said = "";
  }

  onLook(act) {
    element("look").addEventListener("click", act);
  }

  // kind: "vr" or "ar".
  offer(kind, act) {
    element(kind).hidden = false;
    element(kind).addEventListener("click", act);
    element("aligning").hidden = false;
  }

  why(text) {
    element("why").hidden = text === "";
    element("why").textContent = text;
  }

  get alignsOnEntry() {
    return element("align").checked;
  }

  // The three points of the rig that were typed, or null where the tracked finger is meant.
  knownPoints() {
    if (document.querySelector("input[name=points]:checked").value === "finger") return null;
    const points = [...element("known").querySelectorAll("input")].map((input) =>
      input.value.trim().split(/[\s,;]+/).map(Number),
    );
    const good = points.every((point) => point.length === 3 && point.every(Number.isFinite));
    if (!good) throw new Error("write each point as three numbers, in metres: 0.2 0 0");
    return points;
  }

  alignment(text) {
    element("alignment").textContent = text;
  }

  show(live, hands, objects) {
    const lines = [
      ...hands.map(
        (hand) => `${hand.name === "left" ? "Left" : "Right"} hand: ${hand.seen ? "seen" : "waiting for its poses"}`,
      ),
      ...objects.map((one) => `${one.name}: ${one.state}`),
    ];
    const something = [...hands, ...objects].some((one) => one.seen);
    element("look").disabled = !hands.some((hand) => hand.seen);
    element("missing").hidden = something || !live.connected;
    const state = live.connected
      ? `${something ? "Live from" : "Connected to"} the rig “${live.hello.rig}”`
      : live.hello === null
        ? "Waiting for the bridge…"
        : "The bridge does not answer. Trying again…";
    const said = [state, ...lines].join("\n");
    if (said === this.said) return;
    this.said = said;
    element("state").textContent = state;
    element("state").classList.toggle("lost", !live.connected && live.hello !== null);
    element("seen").replaceChildren(
      ...lines.map((line) => {
        const item = document.createElement("li");
        item.textContent = line;
        return item;
      }),
    );
  }
}
