// What the Khronos validator says of a glTF file, as JSON: node validate_gltf.cjs NODE_MODULES FILE.gltf
const fs = require("fs"), path = require("path");
const [modules, file] = process.argv.slice(2);
const validator = require(path.join(modules, "gltf-validator"));
const beside = (uri) => Promise.resolve(new Uint8Array(fs.readFileSync(path.join(path.dirname(file), decodeURIComponent(uri)))));
validator.validateBytes(new Uint8Array(fs.readFileSync(file)), { uri: path.basename(file), externalResourceFunction: beside })
  .then((report) => console.log(JSON.stringify(report.issues)));
