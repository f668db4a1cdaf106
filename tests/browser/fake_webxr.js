// A headset for tests: enough of WebXR's interfaces for three.js to open an immersive session, with
// a head that stands still and a controller that the test moves. It proves that the page drives the
// interfaces, not that a headset does.
(() => {
  const at = (x, y, z) => new XRRigidTransform({ x, y, z });
  class Space extends EventTarget {
    constructor(transform) {
      super();
      this.transform = transform;
    }
  }
  const projection = new Float32Array([1, 0, 0, 0, 0, 1, 0, 0, 0, 0, -1, -1, 0, 0, -0.04, 0]);
  class Frame {
    constructor(session) {
      this.session = session;
    }
    getViewerPose() {
      const views = ["left", "right"].map((eye, k) => ({
        eye,
        projectionMatrix: projection,
        transform: at(k ? 0.03 : -0.03, 1.3, 0.3),
      }));
      return { views, transform: at(0, 1.3, 0.3) };
    }
    getPose(space) {
      return { transform: space.transform };
    }
  }
  class Session extends EventTarget {
    constructor() {
      super();
      this.renderState = { baseLayer: null, depthNear: 0.1, depthFar: 100 };
      this.inputSources = [];
      this.enabledFeatures = ["local-floor"];
      this.environmentBlendMode = "opaque";
      this.frames = 0;
    }
    updateRenderState(state) {
      Object.assign(this.renderState, state);
    }
    async requestReferenceSpace() {
      return new Space(at(0, 0, 0));
    }
    requestAnimationFrame(draw) {
      return window.requestAnimationFrame((time) => {
        this.frames++;
        draw(time, new Frame(this));
      });
    }
    cancelAnimationFrame(id) {
      window.cancelAnimationFrame(id);
    }
    async end() {
      this.dispatchEvent(new Event("end"));
    }
    press(kind, point) {
      const event = new Event(kind);
      event.frame = new Frame(this);
      event.inputSource = { hand: null, targetRaySpace: new Space(at(...(point ?? [0, 0, 0]))) };
      this.dispatchEvent(event);
    }
  }
  class Layer {
    constructor(session, gl) {
      this.framebuffer = null;
      this.framebufferWidth = gl.drawingBufferWidth;
      this.framebufferHeight = gl.drawingBufferHeight;
    }
    getViewport({ eye }) {
      const width = this.framebufferWidth / 2;
      return { x: eye === "left" ? 0 : width, y: 0, width, height: this.framebufferHeight };
    }
  }
  window.XRWebGLLayer = Layer;
  window.XRWebGLBinding = undefined;
  WebGL2RenderingContext.prototype.makeXRCompatible = async () => {};
  const xr = {
    isSessionSupported: async (mode) => mode !== "inline",
    requestSession: async (mode) => {
      window.fakeSession = new Session();
      window.fakeSession.mode = mode;
      return window.fakeSession;
    },
  };
  Object.defineProperty(navigator, "xr", { value: xr, configurable: true });
})();
