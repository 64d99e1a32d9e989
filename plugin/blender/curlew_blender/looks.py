# SPDX-License-Identifier: GPL-3.0-or-later
"""Materials, and the Geometry Nodes group that shows points."""

from typing import Any, Iterable, List, Sequence, Tuple

import bpy

_POINTS, _STREAKS, _SMOKE = "Curlew Particles", "Curlew Streaks", "Curlew Smoke"
CURVE_COLORS = 6
_STOPS: Sequence[Tuple[float, Tuple[float, float, float]]] = (  # slow to fast
    (0.0, (0.03, 0.11, 0.38)), (0.35, (0.03, 0.40, 0.55)), (0.65, (0.85, 0.25, 0.08)), (1.0, (1.0, 0.80, 0.35)),
)


def _material(name: str) -> Tuple[bpy.types.Material, bool]:
    """Returns the material with this name, and whether it is new."""
    material = bpy.data.materials.get(name)
    if material:
        return material, False
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    return material, True


def _show_solid(material: bpy.types.Material, color: Sequence[float]) -> None:
    """Sets the colour in Solid view."""
    material.diffuse_color = (*color[:3], 1.0)


def volume_material() -> bpy.types.Material:
    """Returns the material of volumes: thin smoke."""
    return _smoke("Curlew Volume", 2.0, (0.75, 0.82, 0.95))


def smoke_material() -> bpy.types.Material:
    """Returns the material of particles that are smoke."""
    return _smoke(_SMOKE, 6.0, (0.8, 0.8, 0.8))


def _smoke(name: str, density: float, color: Sequence[float]) -> bpy.types.Material:
    material, is_new = _material(name)
    if is_new:
        _show_solid(material, color)
        tree = material.node_tree
        tree.nodes.clear()
        smoke = tree.nodes.new("ShaderNodeVolumePrincipled")
        smoke.inputs["Density"].default_value = density
        smoke.inputs["Color"].default_value = (*color, 1.0)
        out = tree.nodes.new("ShaderNodeOutputMaterial")
        out.location.x = 320
        tree.links.new(smoke.outputs["Volume"], out.inputs["Volume"])
    return material


def surface_material() -> bpy.types.Material:
    """Returns the material of a level set's mesh."""
    material, is_new = _material("Curlew Surface")
    if is_new:
        shader = material.node_tree.nodes["Principled BSDF"]
        shader.inputs["Base Color"].default_value = (0.25, 0.45, 0.7, 1.0)
        shader.inputs["Roughness"].default_value = 0.4
        _show_solid(material, (0.25, 0.45, 0.7))
    return material


def _color(value: float) -> Tuple[float, float, float]:
    """Interpolates between the stops."""
    for (a, low), (b, high) in zip(_STOPS, _STOPS[1:]):
        if value <= b:
            part = (value - a) / (b - a)
            return tuple(x + part * (y - x) for x, y in zip(low, high))  # type: ignore[return-value]
    return _STOPS[-1][1]


def curve_materials() -> List[bpy.types.Material]:
    """Returns materials from slow to fast."""
    materials = []
    for k in range(CURVE_COLORS):
        material, is_new = _material(f"Curlew Curves {k + 1}")
        if is_new:
            shader = material.node_tree.nodes["Principled BSDF"]
            color = _color(k / (CURVE_COLORS - 1))
            shader.inputs["Base Color"].default_value = (*color, 1.0)
            shader.inputs["Roughness"].default_value = 0.9
            _show_solid(material, color)
        materials.append(material)
    return materials


def particle_material() -> bpy.types.Material:
    """Returns the material of particles, coloured by the attribute `speed`, which is 1 for fast particles."""
    material, is_new = _material(_POINTS)
    if is_new:
        tree = material.node_tree
        shader = tree.nodes["Principled BSDF"]
        shader.inputs["Roughness"].default_value = 0.9
        _show_solid(material, _color(0.6))
        speed = tree.nodes.new("ShaderNodeAttribute")
        speed.attribute_name = "speed"
        speed.location = (-560, 200)
        ramp = tree.nodes.new("ShaderNodeValToRGB")
        ramp.location = (-340, 200)
        elements = ramp.color_ramp.elements
        while len(elements) < len(_STOPS):
            elements.new(1.0)
        for element, (position, color) in zip(elements, _STOPS):
            element.position = position
            element.color = (*color, 1.0)
        tree.links.new(speed.outputs["Fac"], ramp.inputs["Fac"])
        tree.links.new(ramp.outputs["Color"], shader.inputs["Base Color"])
    return material


def _socket(group: bpy.types.NodeTree, name: str, kind: str, is_input: bool) -> bpy.types.ID:
    if hasattr(group, "interface"):
        return group.interface.new_socket(name, in_out="INPUT" if is_input else "OUTPUT", socket_type=kind)
    return (group.inputs if is_input else group.outputs).new(kind, name)


class _Builder:
    """Builds a Geometry Nodes group for particles, with the inputs Size and Fastest."""

    def __init__(self, name: str, **more: float) -> None:
        self.group = bpy.data.node_groups.new(name, "GeometryNodeTree")
        _socket(self.group, "Geometry", "NodeSocketGeometry", True)
        for label, value in {"Size": 0.006, "Fastest": 1.0, **more}.items():
            _socket(self.group, label, "NodeSocketFloat", True).default_value = value
        _socket(self.group, "Geometry", "NodeSocketGeometry", False)
        self.start = self.new("NodeGroupInput", -1000)

    def new(self, kind: str, x: float, y: float = 0.0, **settings: Any) -> bpy.types.Node:
        """Adds a node. A setting is a property, or else the value of an input."""
        node = self.group.nodes.new(kind)
        node.location = (x, y)
        for name, value in settings.items():
            if hasattr(node, name):
                setattr(node, name, value)
            else:
                node.inputs[name.replace("_", " ")].default_value = value
        return node

    def link(self, source: bpy.types.NodeSocket, target: bpy.types.NodeSocket) -> None:
        """Links an output to an input."""
        self.group.links.new(source, target)

    def math(self, operation: str, x: float, y: float, *values: Any, use_clamp: bool = False) -> bpy.types.NodeSocket:
        """Adds a Math node for sockets and numbers. Returns its output."""
        node = self.new("ShaderNodeMath", x, y, operation=operation, use_clamp=use_clamp)
        for k, value in enumerate(values):
            if isinstance(value, float):
                node.inputs[k].default_value = value
            else:
                self.link(value, node.inputs[k])
        return node.outputs[0]

    def attribute(self, name: str, kind: str, x: float, y: float) -> bpy.types.NodeSocket:
        """Adds a Named Attribute node. Returns its output."""
        node = self.new("GeometryNodeInputNamedAttribute", x, y, data_type=kind, Name=name)
        return _enabled(node.outputs, "Attribute")

    def speed(self) -> bpy.types.NodeSocket:
        """Adds the speed relative to the fastest, from 0 to 1."""
        length = self.new("ShaderNodeVectorMath", -600, -200, operation="LENGTH")
        self.link(self.attribute("velocity", "FLOAT_VECTOR", -800, -200), length.inputs[0])
        return self.math("DIVIDE", -420, -200, length.outputs["Value"], self.start.outputs["Fastest"], use_clamp=True)

    def stored(self, speed: bpy.types.NodeSocket) -> bpy.types.NodeSocket:
        """Adds the points, with the attribute `speed`."""
        store = self.new("GeometryNodeStoreNamedAttribute", -240, Name="speed")
        self.link(self.start.outputs["Geometry"], store.inputs["Geometry"])
        self.link(speed, _enabled(store.inputs, "Value"))
        points = self.new("GeometryNodeMeshToPoints", -60)
        self.link(store.outputs["Geometry"], points.inputs[0])
        return points

    def end(self, geometry: bpy.types.NodeSocket, look: bpy.types.Material) -> bpy.types.NodeTree:
        """Adds the material and the output. Returns the group."""
        material = self.new("GeometryNodeSetMaterial", 900, Material=look)
        self.link(geometry, material.inputs["Geometry"])
        self.link(material.outputs["Geometry"], self.new("NodeGroupOutput", 1100).inputs[0])
        return self.group


def _enabled(sockets: Iterable[bpy.types.NodeSocket], name: str) -> bpy.types.NodeSocket:
    return next(socket for socket in sockets if socket.name == name and socket.enabled)


def points_group() -> bpy.types.NodeTree:
    """Returns the Geometry Nodes group that shows vertices as points. Their size and their attribute `speed` grow with
    the length of `velocity`; `fade` scales the size."""
    build = _Builder(_POINTS)
    speed = build.speed()
    points = build.stored(speed)
    radius = build.new("ShaderNodeMapRange", -240, -200, To_Min=0.6, To_Max=1.4)
    build.link(speed, radius.inputs["Value"])
    size = build.math("MULTIPLY", -60, -200, radius.outputs["Result"], build.start.outputs["Size"])
    fade = build.attribute("fade", "FLOAT", -240, -460)
    build.link(build.math("MULTIPLY", 120, -200, size, fade), points.inputs["Radius"])
    return build.end(points.outputs[0], particle_material())


def streaks_group() -> bpy.types.NodeTree:
    """Returns the Geometry Nodes group that shows vertices as streaks along their velocity. Those of the fastest points are
    `Length` times as long as they are thick."""
    build = _Builder(_STREAKS, Length=24.0)
    speed = build.speed()
    points = build.stored(speed)
    cone = build.new("GeometryNodeMeshCone", 120, 260, Vertices=6, Radius_Top=0.15, Radius_Bottom=1.0, Depth=1.0)
    along = build.new("FunctionNodeAlignEulerToVector", 120, -60, axis="Z")
    velocity = build.attribute("velocity", "FLOAT_VECTOR", -240, -460)
    back = build.new("ShaderNodeVectorMath", -60, -460, operation="SCALE", Scale=-1.0)  # the thin end is behind
    build.link(velocity, back.inputs[0])
    build.link(back.outputs[0], along.inputs["Vector"])
    size = build.math("MULTIPLY", 120, -300, build.attribute("fade", "FLOAT", -240, -320), build.start.outputs["Size"])
    scale = build.new("ShaderNodeCombineXYZ", 460, -300)
    build.link(size, scale.inputs["X"])
    build.link(size, scale.inputs["Y"])
    length = build.math("MULTIPLY", 120, -520, speed, build.start.outputs["Length"])
    build.link(build.math("MULTIPLY", 290, -520, build.math("MAXIMUM", 200, -620, length, 2.0), size), scale.inputs["Z"])
    streaks = build.new("GeometryNodeInstanceOnPoints", 540)
    build.link(points.outputs[0], streaks.inputs["Points"])
    build.link(cone.outputs["Mesh"], streaks.inputs["Instance"])
    build.link(along.outputs["Rotation"], streaks.inputs["Rotation"])
    build.link(scale.outputs[0], streaks.inputs["Scale"])
    real = build.new("GeometryNodeRealizeInstances", 720)
    build.link(streaks.outputs[0], real.inputs[0])
    return build.end(real.outputs[0], particle_material())


def smoke_group() -> bpy.types.NodeTree:
    """Returns the Geometry Nodes group that shows vertices as puffs of a volume, which grow with their age."""
    build = _Builder(_SMOKE, Growth=2.0, Voxels=150.0)
    points = build.new("GeometryNodeMeshToPoints", -60)
    build.link(build.start.outputs["Geometry"], points.inputs[0])
    grown = build.math("MULTIPLY", -600, -200, build.attribute("age", "FLOAT", -800, -200), build.start.outputs["Growth"])
    size = build.math("MULTIPLY", -240, -200, build.math("ADD", -420, -200, grown, 1.0), build.start.outputs["Size"])
    radius = build.math("MULTIPLY", -60, -200, size, build.attribute("fade", "FLOAT", -240, -460))
    smoke = build.new("GeometryNodePointsToVolume", 300, resolution_mode="VOXEL_AMOUNT", Density=1.0)
    build.link(points.outputs[0], smoke.inputs["Points"])
    build.link(radius, smoke.inputs["Radius"])
    build.link(build.start.outputs["Voxels"], smoke.inputs["Voxel Amount"])
    return build.end(smoke.outputs[0], smoke_material())


_GROUPS = {"POINTS": (_POINTS, points_group), "STREAKS": (_STREAKS, streaks_group), "SMOKE": (_SMOKE, smoke_group)}


def particles(obj: bpy.types.Object, size: float, fastest: float, look: str = "POINTS") -> None:
    """Adds the group of a look to an object, with the size of its points and the speed at which they are brightest."""
    name, make = _GROUPS[look]
    group = bpy.data.node_groups.get(name) or make()
    ours = {each for each, _ in _GROUPS.values()}
    modifier = next((m for m in obj.modifiers if m.type == "NODES" and m.node_group and m.node_group.name in ours), None)
    if modifier and modifier.node_group != group:
        obj.modifiers.remove(modifier)
        modifier = None
    if modifier is None:
        modifier = obj.modifiers.new(name, "NODES")
        modifier.node_group = group
    sockets = group.interface.items_tree if hasattr(group, "interface") else group.inputs
    values = {"Size": size, "Fastest": fastest}
    for socket in sockets:
        if socket.name in values and modifier.get(socket.identifier) != values[socket.name]:
            modifier[socket.identifier] = values[socket.name]
    material = smoke_material() if look == "SMOKE" else particle_material()
    if obj.data.materials:
        obj.data.materials[0] = material
    else:
        obj.data.materials.append(material)
