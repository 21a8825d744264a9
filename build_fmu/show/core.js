// The library of the FMUs as WebAssembly: one instance of the model, by the functions of FMI 2.0.
const OK_OR_WARNING = 1, NO_SYSTEM = 52; // fmi2Status; errno of a function that is not here

class Core {
  // `binary`: the compiled library; `files`: bytes by name, with model.toml; `guid`: of the model description
  static async load(binary, files, guid) {
    const core = new Core();
    core.messages = [];
    core.lists = new Map();
    const text = (at) => new TextDecoder().decode(core.bytes.subarray(at, core.bytes.indexOf(0, at))), file = (at) => files[text(at).split("/").pop()];
    const host = {
      log: (_, at) => core.messages.push(text(at).replaceAll("%%", "%")),
      file_size: (at) => (file(at) ? file(at).length : -1),
      file_bytes: (at, to) => core.bytes.set(file(at), to),
    };
    // what the C library asks of a system, which is not here
    const system = {};
    for (const name of ["proc_exit", "environ_sizes_get", "environ_get", "fd_close", "fd_write", "fd_read", "fd_seek"]) system[name] = () => NO_SYSTEM;
    const imports = { host, env: { emscripten_notify_memory_growth() {} }, wasi_snapshot_preview1: system };
    core.library = (await WebAssembly.instantiate(binary, imports)).instance.exports;
    core.library._initialize();
    const name = new TextEncoder().encode(`${guid}\0`), at = core.library.malloc(name.length);
    core.bytes.set(name, at);
    core.instance = core.library.redysim_instantiate(at);
    core.library.free(at);
    if (!core.instance) throw core.failure();
    return core;
  }
  // the memory moves when it grows
  get bytes() {
    return new Uint8Array(this.library.memory.buffer);
  }
  failure() {
    return new Error(this.messages.splice(0).join("; ") || "the library failed without a message");
  }
  call(name, ...values) {
    if (this.library[name](this.instance, ...values) > OK_OR_WARNING) throw this.failure();
  }
  // Real variables by value references, read and written together
  list(references) {
    const key = references.join();
    if (!this.lists.has(key)) {
      // malloc aligns for numbers; the references follow the values
      const count = references.length, from = this.library.malloc(12 * count + 1), index = from + 8 * count;
      new Uint32Array(this.library.memory.buffer, index, count).set(references);
      this.lists.set(key, { count, index, from });
    }
    return this.lists.get(key);
  }
  values({ from, count }) {
    return new Float64Array(this.library.memory.buffer, from, count);
  }
  read(list) {
    this.call("fmi2GetReal", list.index, list.count, list.from);
    return this.values(list);
  }
  write(list, values) {
    this.values(list).set(values);
    this.call("fmi2SetReal", list.index, list.count, list.from);
  }
  initialise(start) {
    this.call("fmi2SetupExperiment", 0, 0, start, 0, 0);
    this.call("fmi2EnterInitializationMode");
    this.call("fmi2ExitInitializationMode");
  }
  step(time, size) {
    this.call("fmi2DoStep", time, size, 1);
  }
  reset() {
    this.call("fmi2Reset");
  }
}
