// The rig's messages, from the bridge that served this page; it may go and come.

const RETRY_MS = 1000;

// Newest message of each topic, with when it came (performance.now()).
export class Live {
  constructor() {
    this.hello = null;
    this.connected = false;
    this.newest = new Map();
    this.onHello = () => {};
    this.onChange = () => {};
    this.#open();
  }

  // The newest message of a topic, or null where none came in the last second.
  message(topic, now) {
    const found = this.newest.get(topic);
    return found !== undefined && now - found.at < 1000 ? found.message : null;
  }

  #open() {
    const scheme = location.protocol === "https:" ? "wss" : "ws";
    const socket = new WebSocket(`${scheme}://${location.host}/live${location.search}`);
    socket.onmessage = (event) => {
      const { topic, message } = JSON.parse(event.data);
      if (topic === "hello") {
        this.hello = message;
        this.connected = true;
        this.onHello(message);
      } else {
        this.newest.set(topic, { message, at: performance.now() });
      }
      this.onChange();
    };
    // Also where nobody answers: the bridge is started anew, or the network returns.
    socket.onclose = () => {
      this.connected = false;
      this.onChange();
      setTimeout(() => this.#open(), RETRY_MS);
    };
  }
}
