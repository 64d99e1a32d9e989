# SPDX-License-Identifier: GPL-3.0-or-later
"""The panel of the 3D view, the header and the menu of the node editor."""

from typing import Dict, List

import bpy
import nodeitems_utils

from . import bake, library, nodes, outdated, preview, presets, shots, values
from . import tree as trees
from .actions import NO_NODE, Action


def _draw_bake(layout: bpy.types.UILayout, tree: bpy.types.NodeTree) -> None:
    row = layout.row(align=True)
    run = bake.running.get(tree.name)
    if run:
        title, fraction = run.progress()
        row.operator("curlew.cancel", text=f"Cancel  {100 * fraction:.0f} %  {title}", icon="CANCEL").tree = tree.name
        return
    row.operator("curlew.bake", icon="PLAY").tree = tree.name
    row.operator("curlew.free_bake", text="", icon="X").tree = tree.name
    row.operator("curlew.clear_cache", text="", icon="TRASH")


def _draw_live(layout: bpy.types.UILayout, tree: bpy.types.NodeTree, scene: bpy.types.Scene) -> None:
    column = layout.column()
    column.active = not trees.is_sequence(tree)
    column.prop(tree, "bake_on_frame")
    if tree.bake_on_frame:
        column.prop(tree, "keep_frames")
    if (tree.bake_on_frame or trees.is_sequence(tree)) and not scene.render.use_lock_interface:
        warn = layout.row()
        warn.alert = True
        warn.prop(scene.render, "use_lock_interface", text="Lock Interface (Recommended)")


class CURLEW_PT_view(bpy.types.Panel):
    """Pick an object, press one button."""

    bl_idname = "CURLEW_PT_view"
    bl_label = "Curlew"
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "Curlew"

    def draw(self, context: bpy.types.Context) -> None:
        """Draws the panel."""
        layout, scene = self.layout, context.scene
        if library.updated():
            warn = layout.row()
            warn.alert = True
            warn.label(text="Updated: restart Blender", icon="ERROR")
        obj = context.active_object
        preset = presets.PRESETS[scene.curlew_preset]
        box = layout.column(align=True)
        box.label(text=obj.name if obj and preset.needs_mesh else "No Active Object" if preset.needs_mesh else "No Object Needed",
                  icon="OBJECT_DATA")
        box.prop(scene, "curlew_preset", text="")
        big = box.row()
        big.scale_y = 1.5
        big.operator("curlew.quick", icon="FORCE_VORTEX").preset = scene.curlew_preset
        layout.separator()
        layout.prop_search(scene, "curlew_tree", bpy.data, "node_groups", text="Tree")
        tree = bpy.data.node_groups.get(scene.curlew_tree)
        if tree is None or tree.bl_idname != nodes.TREE:
            return
        _draw_bake(layout, tree)
        row = layout.row()
        row.prop(tree, "sequence")
        sub = row.row()
        sub.active = tree.sequence
        sub.prop(tree, "substeps")
        if tree.sequence:
            row = layout.row()
            row.prop(tree, "run_up")
            row.prop(tree, "repeat")
        _draw_live(layout, tree, scene)
        layout.prop(tree, "preview")
        if not bpy.data.filepath:
            layout.label(text="Save the file to keep bakes", icon="FILE_TICK")
        count = outdated.results(tree)
        if count:
            layout.label(text="Results are older than their settings" if count > 1 else "The result is older than its settings",
                         icon="FILE_REFRESH")
        if tree.message:
            layout.label(text=tree.message, icon="INFO")


def draw_header(self: bpy.types.Header, context: bpy.types.Context) -> None:
    """Draws into the header of a node editor with a Curlew tree."""
    space = context.space_data
    if space.tree_type != nodes.TREE:
        return
    row = self.layout.row(align=True)
    if space.node_tree:
        _draw_bake(row, space.node_tree)
        row.prop(space.node_tree, "sequence", toggle=True)
        live = row.row(align=True)
        live.active = not trees.is_sequence(space.node_tree)
        live.prop(space.node_tree, "bake_on_frame", text="", icon="TIME")
        row.prop(space.node_tree, "preview", text="")
        row.operator("curlew.export_scene", text="", icon="EXPORT")
    row.operator("curlew.import_scene", text="", icon="IMPORT")


class _Category(nodeitems_utils.NodeCategory):
    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Returns whether the editor shows a Curlew tree."""
        return context.space_data.tree_type == nodes.TREE


def _draw_shots(item: nodeitems_utils.NodeItemCustom, layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    layout.operator_context = "INVOKE_DEFAULT"
    for kind, shot in shots.SHOTS.items():
        layout.operator("curlew.add_shot", text=shot.name).kind = kind


def categories(actions: Dict[str, Action]) -> List[nodeitems_utils.NodeCategory]:
    """Returns the registry's groups, and those for Blender's own objects."""
    item = nodeitems_utils.NodeItem
    groups: Dict[str, List[str]] = {}
    for name, action in actions.items():
        if name not in NO_NODE:
            groups.setdefault(action.group, []).append(nodes.action_id(name))
    result = [_Category("CURLEW_SHOT", "Shot", items=[
                  nodeitems_utils.NodeItemCustom(draw=_draw_shots), *map(item, map(nodes.action_id, ("superpose", "advect"))),
                  item("CurlewParticlesResult")]),
              _Category("CURLEW_SOURCES", "Sources", items=[item(cls.bl_idname) for cls in (
                  nodes.CurlewMeshObject, nodes.CurlewCurveObject, nodes.CurlewVolumeObject, *values.CLASSES)])]
    for group, ids in groups.items():
        result.append(_Category("CURLEW_" + group.upper().replace(" ", "_"), group.capitalize(),
                                items=[item(i) for i in ids]))
    result.append(_Category("CURLEW_RESULTS", "Results", items=[item(cls.bl_idname) for cls in nodes.RESULTS]))
    result.append(_Category("CURLEW_LAYOUT", "Layout", items=[item(nodes.CurlewGroup.bl_idname), item("NodeFrame"),
                                                              item("NodeReroute"), item("NodeGroupInput"),
                                                              item("NodeGroupOutput")]))
    return result


def register() -> None:
    """Registers the panel, the header, the menu and the scene's properties."""
    bpy.types.Scene.curlew_preset = bpy.props.EnumProperty(
        name="Preset", items=[(key, p.name, p.help) for key, p in presets.PRESETS.items()])
    # Stores the name: with a pointer to a tree, Blender 3.4 crashes when factory settings are loaded.
    bpy.types.Scene.curlew_tree = bpy.props.StringProperty(name="Tree", description="Tree that the buttons below bake")
    bpy.utils.register_class(CURLEW_PT_view)
    bpy.types.NODE_HT_header.append(draw_header)
    nodeitems_utils.register_node_categories("CURLEW", categories(library.actions()))
    preview.register()


def unregister() -> None:
    """Unregisters them."""
    preview.unregister()
    nodeitems_utils.unregister_node_categories("CURLEW")
    bpy.types.NODE_HT_header.remove(draw_header)
    bpy.utils.unregister_class(CURLEW_PT_view)
    del bpy.types.Scene.curlew_tree
    del bpy.types.Scene.curlew_preset
