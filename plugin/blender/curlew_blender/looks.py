# SPDX-License-Identifier: GPL-3.0-or-later
"""Materials, and the Geometry Nodes group that shows points."""

from typing import List, Sequence, Tuple

import bpy

_POINTS = "Curlew Particles"
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


def volume_material() -> bpy.types.Material:
    """Returns the material of volumes: smoke."""
    material, is_new = _material("Curlew Volume")
    if is_new:
        tree = material.node_tree
        tree.nodes.clear()
        smoke = tree.nodes.new("ShaderNodeVolumePrincipled")
        smoke.inputs["Density"].default_value = 2.0
        smoke.inputs["Color"].default_value = (0.75, 0.82, 0.95, 1.0)
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
            shader.inputs["Base Color"].default_value = (*_color(k / (CURVE_COLORS - 1)), 1.0)
            shader.inputs["Roughness"].default_value = 0.9
        materials.append(material)
    return materials


def particle_material() -> bpy.types.Material:
    """Returns the material of particles, coloured by the attribute `speed`, which is 1 for fast particles."""
    material, is_new = _material(_POINTS)
    if is_new:
        tree = material.node_tree
        shader = tree.nodes["Principled BSDF"]
        shader.inputs["Roughness"].default_value = 0.9
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


def points_group() -> bpy.types.NodeTree:
    """Returns the Geometry Nodes group that shows vertices as points. Their size and their attribute `speed` grow with
    the length of `velocity`; `fade` scales the size."""
    group = bpy.data.node_groups.get(_POINTS)
    if group:
        return group
    group = bpy.data.node_groups.new(_POINTS, "GeometryNodeTree")
    _socket(group, "Geometry", "NodeSocketGeometry", True)
    for name, value in (("Size", 0.006), ("Fastest", 1.0)):
        socket = _socket(group, name, "NodeSocketFloat", True)
        socket.default_value = value
    _socket(group, "Geometry", "NodeSocketGeometry", False)
    nodes, links = group.nodes, group.links

    def new(kind: str, x: float, y: float = 0.0) -> bpy.types.Node:
        node = nodes.new(kind)
        node.location = (x, y)
        return node

    start = new("NodeGroupInput", -800)
    velocity = new("GeometryNodeInputNamedAttribute", -800, -200)
    velocity.data_type = "FLOAT_VECTOR"
    velocity.inputs["Name"].default_value = "velocity"
    length = new("ShaderNodeVectorMath", -600, -200)
    length.operation = "LENGTH"
    divide = new("ShaderNodeMath", -420, -200)
    divide.operation = "DIVIDE"
    divide.use_clamp = True
    radius = new("ShaderNodeMapRange", -240, -200)
    radius.inputs["To Min"].default_value = 0.6
    radius.inputs["To Max"].default_value = 1.4
    size = new("ShaderNodeMath", -60, -200)
    size.operation = "MULTIPLY"
    fade = new("GeometryNodeInputNamedAttribute", -240, -460)
    fade.data_type = "FLOAT"
    fade.inputs["Name"].default_value = "fade"
    seen = new("ShaderNodeMath", 120, -200)
    seen.operation = "MULTIPLY"
    store = new("GeometryNodeStoreNamedAttribute", -240)
    store.inputs["Name"].default_value = "speed"
    points = new("GeometryNodeMeshToPoints", 300)
    material = new("GeometryNodeSetMaterial", 500)
    material.inputs["Material"].default_value = particle_material()
    end = new("NodeGroupOutput", 700)
    links.new([s for s in velocity.outputs if s.name == "Attribute" and s.enabled][0], length.inputs[0])
    links.new(length.outputs["Value"], divide.inputs[0])
    links.new(start.outputs["Fastest"], divide.inputs[1])
    links.new(divide.outputs[0], radius.inputs["Value"])
    links.new(radius.outputs["Result"], size.inputs[0])
    links.new(start.outputs["Size"], size.inputs[1])
    links.new(start.outputs["Geometry"], store.inputs["Geometry"])
    links.new(divide.outputs[0], [s for s in store.inputs if s.name == "Value" and s.enabled][0])
    links.new(store.outputs["Geometry"], points.inputs[0])
    links.new(size.outputs[0], seen.inputs[0])
    links.new([s for s in fade.outputs if s.name == "Attribute" and s.enabled][0], seen.inputs[1])
    links.new(seen.outputs[0], points.inputs["Radius"])
    links.new(points.outputs[0], material.inputs["Geometry"])
    links.new(material.outputs["Geometry"], end.inputs[0])
    return group


def particles(obj: bpy.types.Object, size: float, fastest: float) -> None:
    """Adds the group to an object, with the size of its points and the speed at which they are brightest."""
    group = points_group()
    modifier = next((m for m in obj.modifiers if m.type == "NODES" and m.node_group == group), None)
    if modifier is None:
        modifier = obj.modifiers.new(_POINTS, "NODES")
        modifier.node_group = group
    sockets = group.interface.items_tree if hasattr(group, "interface") else group.inputs
    values = {"Size": size, "Fastest": fastest}
    for socket in sockets:
        if socket.name in values and modifier.get(socket.identifier) != values[socket.name]:
            modifier[socket.identifier] = values[socket.name]
    if obj.data.materials:
        obj.data.materials[0] = particle_material()
    else:
        obj.data.materials.append(particle_material())
