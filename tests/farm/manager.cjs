// What Flamenco's Manager does with a job type, as far as scripts can see it, for tests: node manager.cjs SCRIPT.js [SETTINGS.json]
// prints {"type": JOB_TYPE} or, with settings, {"settings", "tasks"} of the compiled job, as JSON.
//
// After Flamenco's documentation (flamenco.blender.org/usage/job-types) and its internal/manager/job_compilers (author.go, js_globals.go, scripts.go): the
// globals print, alert, frameChunker, formatTimestampLocal, author, path and process, and no others; tasks and commands are Go structs, which
// have no other fields and whose wrong use is an exception; a job keeps a copy of a task as it is when it is added.

const assert = require("assert");
const fs = require("fs");
const path = require("path");
const vm = require("vm");

const GLOBALS = ["print", "alert", "frameChunker", "formatTimestampLocal", "author", "path", "process"];
const CREATED = new Date(2026, 0, 2, 3, 4, 5);

class Task {
    constructor(name, type) {
        assert(typeof name === "string" && name.trim(), "author.Task(name, type): name is required");
        assert(typeof type === "string" && type.trim(), "author.Task(name, type): type is required");
        Object.assign(this, { uuid: `${name}-${Math.random()}`, name: name.trim(), type: type.trim(), priority: 50, commands: [], dependencies: [] });
        Object.seal(this);
    }
    addCommand(command) {
        assert(command instanceof Command, "task.addCommand(command): no command");
        this.commands.push(command);
    }
    addDependency(task) {
        assert(task instanceof Task, "task.addDependency(task): no task");
        this.dependencies.push(task);
    }
}

class Command {
    constructor(name, parameters, totalStepCount = 0) {
        assert(typeof name === "string" && parameters && parameters.constructor && parameters.constructor.name === "Object", "author.Command(name, parameters)");
        Object.assign(this, { name, parameters, totalStepCount });
        Object.seal(this);
    }
}

function jobOf(settings) {
    const tasks = [];
    const job = {
        jobID: "8b2d5d8e", workerTagUUID: "", name: "a job", jobType: "reflect-bake", priority: 50, status: "under-construction", created: CREATED,
        settings, metadata: {}, storage: { shamanCheckoutID: "" }, tasks,
        addTask(task) {
            assert(task instanceof Task, "job.addTask(task): no task");
            tasks.push({ ...task, commands: [...task.commands], dependencies: [...task.dependencies] });
        },
    };
    return Object.seal(job);
}

function formatTimestampLocal(time) {
    assert(time instanceof Date, "formatTimestampLocal(time): no time");
    const two = number => String(number).padStart(2, "0");
    return `${time.getFullYear()}-${two(time.getMonth() + 1)}-${two(time.getDate())}_${two(time.getHours())}${two(time.getMinutes())}${two(time.getSeconds())}`;
}

const [script, given] = process.argv.slice(2);
const said = (...words) => console.error(...words);
const context = vm.createContext({
    print: said, alert: said, formatTimestampLocal,
    frameChunker: () => { throw new Error("no frames here"); },
    author: { Task: (name, type) => new Task(name, type), Command: (name, parameters, steps) => new Command(name, parameters, steps) },
    path: { basename: path.basename, dirname: path.dirname, join: path.join, stem: file => path.parse(file).name },
    process: { cwd: () => process.cwd(), platform: process.platform },
});
vm.runInContext(fs.readFileSync(script, "utf8"), context, { filename: script });
const type = vm.runInContext("JOB_TYPE", context);
const unknown = Object.keys(context).filter(name => !GLOBALS.includes(name) && typeof context[name] !== "function");
assert.deepStrictEqual(unknown, [], "globals beside functions");
assert.strictEqual(vm.runInContext("typeof compileJob", context), "function");
if (!given) {
    console.log(JSON.stringify({ type }));
} else {
    const job = jobOf(JSON.parse(fs.readFileSync(given, "utf8")));
    for (const setting of type.settings) {
        assert(!setting.required || setting.key in job.settings, `the setting ${setting.key} is required`);
    }
    context.compileJob(job);
    const added = new Set(job.tasks.map(task => task.uuid));
    for (const task of job.tasks) {
        assert(task.commands.length, `${task.name} does nothing`);
        assert(task.dependencies.every(other => added.has(other.uuid)), `${task.name} waits for a task that is not the job's`);
    }
    const tasks = job.tasks.map(task => ({ ...task, dependencies: task.dependencies.map(other => other.name) }));
    console.log(JSON.stringify({ settings: job.settings, tasks }));
}
