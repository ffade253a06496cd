// SPDX-License-Identifier: GPL-3.0-or-later

// A job type for Flamenco, Blender's render farm: reflections are baked in parts by as many workers as are free, put together, and on
// request judged in parts as well. Copy this file into the folder `scripts` beside flamenco-manager. docs/farms.md says what workers need.

const JOB_TYPE = {
    label: "Reflect Bake",
    description: "Bake reflections in parts and put them together; on request, measure how wrong each method is",
    settings: [
        // For artists to decide:
        { key: "methods", type: "string", required: true, default: "all",
          description: "Methods to bake, separated by commas, or all" },
        { key: "parts", type: "int32", required: true, default: 4, propargs: { min: 1, max: 9999 }, visible: "submission",
          description: "Into how many parts the bake is divided: as many as there are workers" },
        { key: "objects", type: "string", default: "",
          description: "Bake only these reflectors, separated by commas. All of them when empty" },
        { key: "resolution", type: "int32", default: 0, propargs: { min: 0, max: 8192 },
          description: "Of the baked images, in texels: a power of two. 0: each method's own" },
        { key: "samples", type: "int32", default: 0, propargs: { min: 0, max: 999999 },
          description: "Paths per texel. 0: each method's own" },
        { key: "bake_options", type: "string", default: "", visible: "submission",
          description: "More options of reflect bake, separated by spaces. Example: --set texels=256" },
        { key: "evaluate", type: "bool", default: false,
          description: "Measure the baked methods against Cycles, too" },
        { key: "evaluate_size", type: "string", default: "480x270", visible: "submission",
          description: "Size of the pictures that are measured, in pixels" },
        { key: "evaluate_samples", type: "int32", default: 64, propargs: { min: 1, max: 999999 }, visible: "submission",
          description: "Paths per pixel of the truth that methods are measured against" },
        { key: "evaluate_parts", type: "int32", default: 2, propargs: { min: 1, max: 9999 }, visible: "submission",
          description: "Into how many parts the measuring is divided. Each traces the truth" },
        { key: "output_root", type: "string", subtype: "dir_path", required: true, visible: "submission",
          description: "Folder that all workers reach. What the job makes goes below it" },
        { key: "output_path", type: "string", subtype: "dir_path", editable: false,
          eval: "str(Path(abspath(settings.output_root), jobname, '{timestamp}'))",
          description: "Where the job's assets (assets) and measurements (evaluation) will be" },

        // Determined automatically:
        { key: "blendfile", type: "string", required: true, visible: "web", description: "Path of the Blend file" },
        { key: "scene", type: "string", eval: "C.scene.name", visible: "web", description: "Scene whose reflectors are baked" },
    ]
};

function compileJob(job) {
    const settings = job.settings;
    if (!settings.output_path) {
        throw "no output_path setting!";
    }
    if (settings.evaluate && settings.objects) {
        throw "a frame is measured with all its reflectors: leave objects empty, or do not evaluate";
    }
    // Shown with the job from now on: the folder that is really used.
    settings.output_path = settings.output_path.replace("{timestamp}", formatTimestampLocal(job.created));
    const assets = path.join(settings.output_path, "assets");

    const baked = addParts(job, settings, "bake", settings.parts, bakeOptions(settings), assets, []);
    if (settings.evaluate) {
        const options = [
            "--methods", settings.methods,
            "--size", settings.evaluate_size,
            "--samples", String(settings.evaluate_samples),
            "--assets", assets,
        ];
        addParts(job, settings, "evaluate", settings.evaluate_parts, options, path.join(settings.output_path, "evaluation"), [baked]);
    }
}

function bakeOptions(settings) {
    const options = ["--methods", settings.methods];
    for (const name of ["objects", "resolution", "samples"]) {
        if (settings[name]) {
            options.push(`--${name}`, String(settings[name]));
        }
    }
    return options.concat((settings.bake_options || "").split(" ").filter(word => word));
}

// The tasks of one verb's parts, after those of `after`, and the one that merges them into `out`, which is returned.
function addParts(job, settings, verb, count, options, out, after) {
    if (!(count >= 1)) {
        throw `${verb} needs at least one part, not ${count}`;
    }
    const merge = author.Task(`merge-${verb}`, "blender");
    const folders = [];
    for (let part = 1; part <= count; part++) {
        const folder = path.join(settings.output_path, "parts", `${verb}-${part}`);
        const task = author.Task(`${verb}-${part}-of-${count}`, "blender");
        const scene = settings.scene ? ["--scene", settings.scene] : [];
        task.addCommand(reflect([settings.blendfile], [verb, ...options, ...scene, "--part", `${part}/${count}`, "--out", folder]));
        for (const earlier of after) {
            task.addDependency(earlier);
        }
        job.addTask(task);
        merge.addDependency(task);
        folders.push(folder);
    }
    merge.addCommand(reflect([], ["merge", ...folders, "--out", out]));
    job.addTask(merge);
    return merge;
}

// Blender without a window, with the worker's own preferences, in which Reflect is enabled.
function reflect(blendfile, words) {
    return author.Command("exec", {
        exe: "{blender}",
        args: ["-b", ...blendfile, "--command", "reflect", ...words],
    });
}
