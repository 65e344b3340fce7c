// Counts GPU objects in a page.

/** GPU objects that were made and not freed, by the name of the call that makes them. */
export const alive = {};

/** Counts what `make` makes until `free` is called for it. */
function count(makers, make, freers, free) {
  const [made, freed] = [makers[make], freers[free]];
  const seen = new WeakSet();
  alive[make] = 0;
  makers[make] = function (...args) {
    const one = made.apply(this, args);
    seen.add(one);
    alive[make]++;
    return one;
  };
  freers[free] = function (...args) {
    if (seen.delete(args[0] ?? this)) alive[make]--; // gl.deleteBuffer(buffer), buffer.destroy()
    return freed.apply(this, args);
  };
}

/** Counts from now on. */
export function countGpu(backend) {
  if (backend === "webgl2") {
    const gl = WebGL2RenderingContext.prototype;
    for (const kind of ["Buffer", "Texture", "Framebuffer", "VertexArray", "Program"]) count(gl, `create${kind}`, gl, `delete${kind}`);
  } else {
    const device = GPUDevice.prototype;
    count(device, "createBuffer", GPUBuffer.prototype, "destroy");
    count(device, "createTexture", GPUTexture.prototype, "destroy");
  }
}
