"""Runs node groups on given inputs: a plane whose every pixel reads its inputs from float images, outputs as AOVs."""

import numpy as np

from reflect_addon.scene.node_images import image_from

WIDTH = 64  # pixels per row


def run_nodes(bpy, tmp_path, groups: dict, inputs: dict[str, np.ndarray], engine="CYCLES") -> dict[str, dict[str, np.ndarray]]:
    """groups: key -> (node group, {output: size}). Returns key -> output -> (N,) or (N, size) float32."""
    count = len(next(iter(inputs.values())))
    rows = -(-count // WIDTH)
    scene = _plane(bpy, rows, engine)
    material = bpy.data.materials.new("bench")
    if material.node_tree is None:  # before 6.0 materials start without one
        material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    window = tree.nodes.new("ShaderNodeTexCoord").outputs["Window"]
    sources = {}
    for name, values in inputs.items():
        pixels = np.zeros((rows * WIDTH, 4), np.float32)
        values = np.asarray(values, np.float32).reshape(count, -1)
        pixels[:count, : values.shape[1]] = values
        look_up = tree.nodes.new("ShaderNodeTexImage")
        look_up.image = image_from(f"input {name}", pixels.reshape(rows, WIDTH, 4))
        look_up.interpolation, look_up.extension = "Closest", "EXTEND"
        tree.links.new(window, look_up.inputs["Vector"])
        source = look_up.outputs["Color"]
        if values.shape[1] == 1:  # a colour plugged into a float becomes its luminance
            separate = tree.nodes.new("ShaderNodeSeparateXYZ")
            tree.links.new(source, separate.inputs[0])
            source = separate.outputs["X"]
        sources[name.capitalize()] = source
    layer = scene.view_layers[0]
    for key, (group, outputs) in groups.items():
        node = tree.nodes.new("ShaderNodeGroup")
        node.node_tree = group
        for name, source in sources.items():
            if name in node.inputs:
                tree.links.new(source, node.inputs[name])
        for name, size in outputs.items():
            aov = layer.aovs.add()
            aov.name, aov.type = f"{key}_{name}", "COLOR"  # EEVEE stores zeros in those of type VALUE
            store = tree.nodes.new("ShaderNodeOutputAOV")
            store.aov_name = aov.name
            tree.links.new(node.outputs[name.capitalize()], store.inputs["Color"])
    emission, surface = tree.nodes.new("ShaderNodeEmission"), tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(emission.outputs[0], surface.inputs["Surface"])
    bpy.data.objects["bench"].data.materials.append(material)
    channels = rendered(bpy, scene, tmp_path / "bench.exr")
    answers = {}
    for key, (_, outputs) in groups.items():
        answers[key] = {}
        for name, size in outputs.items():
            planes = [channels[f"{key}_{name}.{letter}"].ravel()[:count] for letter in "RGB"[:size]]
            answers[key][name] = planes[0] if size == 1 else np.stack(planes, -1)
    return answers


def _plane(bpy, rows: int, engine: str):
    scene = bpy.context.scene
    mesh = bpy.data.meshes.new("bench")
    mesh.from_pydata([(-9, -9, 0), (9, -9, 0), (9, 9, 0), (-9, 9, 0)], [], [(0, 1, 2, 3)])
    scene.collection.objects.link(bpy.data.objects.new("bench", mesh))
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    camera.data.type, camera.location = "ORTHO", (0, 0, 1)
    scene.collection.objects.link(camera)
    scene.camera = camera
    prepare(scene, engine, WIDTH, rows)
    return scene


def prepare(scene, engine: str, width: int, height: int) -> None:
    """One sample through the middle of each pixel, AOVs as floats."""
    render = scene.render
    render.engine = engine
    render.resolution_x, render.resolution_y, render.resolution_percentage = width, height, 100
    if engine == "CYCLES":
        scene.cycles.samples = 1
        scene.cycles.use_denoising = scene.cycles.use_adaptive_sampling = False
        scene.cycles.pixel_filter_type, scene.cycles.filter_width = "BOX", 0.01
    else:
        scene.eevee.taa_render_samples = 1
        render.filter_size = 0.0
    settings = render.image_settings
    settings.media_type = "MULTI_LAYER_IMAGE"
    settings.file_format, settings.color_depth, settings.exr_codec = "OPEN_EXR_MULTILAYER", "32", "NONE"
    settings.use_exr_interleave = True


def rendered(bpy, scene, path) -> dict[str, np.ndarray]:
    """AOV_NAME.CHANNEL -> (height, width), row 0 at the bottom."""
    bpy.utils.expose_bundled_modules()
    import OpenImageIO as oiio

    scene.render.filepath = str(path)
    bpy.ops.render.render(write_still=True)
    file = oiio.ImageInput.open(str(path))
    names = file.spec().channelnames
    pixels = np.asarray(file.read_image(0, 0, 0, len(names), "float"))[::-1]
    file.close()
    return {name.partition(".")[2]: pixels[..., i] for i, name in enumerate(names)}
