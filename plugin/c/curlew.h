/* SPDX-License-Identifier: Apache-2.0 */
/*
 * Curlew as a library, for programs in C and for whatever can call C: sessions that run programs (a graph as JSON, or
 * the text of a scene: one action a line, as `curlew -config` takes it), geometry in and out as arrays, and fields and
 * flows that are evaluated at positions.
 *
 * Every function that can fail returns a status. What went wrong is told by curlew_error_message() and its siblings, on
 * the same thread, until the next failure there. A pointer that is NULL where it may not be is a failure like any
 * other. Nothing is ever printed, no signal is caught, and no function ends the process.
 *
 * Text is UTF-8 and ends with a 0. Positions are in world units, velocities in world units per second.
 *
 * Threads: different sessions may be used by different threads at the same time. One session is used by one thread at a
 * time; only curlew_cancel() may be called while it runs. Fields and flows never change, so that any number of threads
 * may evaluate the same one. All of them compute on all processors; the action `threads` limits the whole process, for
 * as long as the program runs that has it.
 */
#ifndef CURLEW_H
#define CURLEW_H

#include <stddef.h>
#include <stdint.h>

#if defined(_WIN32)
#define CURLEW_API
#else
#define CURLEW_API __attribute__((visibility("default")))
#endif

#ifdef __cplusplus
extern "C" {
#endif

/* --- the library ------------------------------------------------------------------------------------------------ */

/** Of this header. A library of another version may not be used through it: compare with curlew_abi_version(). */
#define CURLEW_ABI_VERSION 2

CURLEW_API int32_t curlew_abi_version(void);

/** "curlew 0.2.0 (1f3b5c7d90, AVX2)": version, commit and the instruction set in use, for the reader; NULL where it
 * fails. */
CURLEW_API const char* curlew_version(void);

/** All actions with their options, defaults, ranges and help as JSON: {"actions": [{"name", "group", "summary",
    "inputs", "outputs", "options", "positional", "examples"}]}. NULL where it fails. */
CURLEW_API const char* curlew_registry(void);

/** Whether files of points (.vdb) and pictures (.exr) are read by a process of their own, so that one that is damaged
    cannot end this process: 1, the default, or 0. It takes the command `curlew`, which is looked for beside this
   library and in the bin/ of its installation, or where the environment variable CURLEW_READER says; without it they
   are read in this process. For the whole process. Returns whether they are now read by another process. */
CURLEW_API int32_t curlew_read_isolated(int32_t on);

/* --- errors ----------------------------------------------------------------------------------------------------- */

typedef int32_t curlew_status;
enum {
    CURLEW_OK = 0,
    CURLEW_VALUE_ERROR = 1,    /**< A value, a name or a program that cannot be used. */
    CURLEW_FILE_ERROR = 2,     /**< A file that cannot be read or written. */
    CURLEW_RESOURCE_ERROR = 3, /**< More memory would be needed than there is: found out beforehand. */
    CURLEW_CANCELLED = 4,      /**< By a callback or by curlew_cancel(). */
    CURLEW_OUT_OF_MEMORY = 5,  /**< Found out too late, but all is in order. */
    CURLEW_INTERNAL_ERROR = 6  /**< A fault of the library. */
};

/** Of the last call on this thread that has failed; CURLEW_OK where none has. */
CURLEW_API curlew_status curlew_error_status(void);

/** One line for the user: what, where, and what to do about it; "" where nothing has failed. */
CURLEW_API const char* curlew_error_message(void);

/** The line of the program's text that has failed, from 1; 0 where it is no line's fault. */
CURLEW_API int32_t curlew_error_line(void);

/** The name of the action that has failed; "" where it is none's fault. */
CURLEW_API const char* curlew_error_action(void);

/** The name of the node that has failed; "" if it is no node's fault. */
CURLEW_API const char* curlew_error_node(void);

/* --- arrays ----------------------------------------------------------------------------------------------------- */

typedef int32_t curlew_type;
enum { CURLEW_FLOAT32 = 0, CURLEW_FLOAT64 = 1, CURLEW_INT32 = 2, CURLEW_INT64 = 3 };

/** `count` items of `components` numbers each; the numbers of an item are next to each other, and from item to item it
    is `stride` bytes (0: the size of an item). Numbers need not be aligned. Where there are no items, data may be NULL.
 */
typedef struct curlew_array {
    const void* data;
    int64_t count;
    int64_t stride;
    int32_t components;
    curlew_type type;
} curlew_array;

/** The same, to be written to. */
typedef struct curlew_buffer {
    void* data;
    int64_t count;
    int64_t stride;
    int32_t components;
    curlew_type type;
} curlew_buffer;

/* --- sessions --------------------------------------------------------------------------------------------------- */

/** Everything that programs have made so far: stacks of fields, flows, grids, meshes, points, curves and images. */
typedef struct curlew_session curlew_session;

/** A new session with nothing in it. Release it. */
CURLEW_API curlew_status curlew_session_create(curlew_session** session);

/** Releases the session, and sets the pointer to NULL: doing it again does nothing. While the session runs, in its own
    callbacks, too, this is refused: it stays as it is. */
CURLEW_API curlew_status curlew_session_release(curlew_session** session);

/** `read NAME` in programs of this session takes this mesh from now on, and no file. It is the mesh that would be read
    from a file of these points (3 components, floats) and faces: points with the same position become one, those of no
    face are left out, and larger polygons become triangles.
    corners: where `sizes` is NULL, an item for each face, 3 or 4 integers each; else all corners of all faces, one
    after another, in items of 1, and `sizes` has how many corners each face has, in items of 1. Arrays are copied. */
CURLEW_API curlew_status curlew_provide_mesh(curlew_session* session, const char* name, const curlew_array* points,
                                             const curlew_array* corners, const curlew_array* sizes);

/** `read NAME` in programs of this session takes these points from now on, and no file. Positions and velocities have
    3 components, floats; ids are integers, 1 component. `ids` may be NULL: 0, 1, 2, …; `velocities` may be NULL: none.
    Arrays are copied. */
CURLEW_API curlew_status curlew_provide_points(curlew_session* session, const char* name, const curlew_array* positions,
                                               const curlew_array* ids, const curlew_array* velocities);

/** What was provided under that name is not there any more. */
CURLEW_API curlew_status curlew_withdraw(curlew_session* session, const char* name);

/** Functions that curlew_run() calls, each of which may be NULL. None of them may throw, or call for the same session,
    with the exception of `frame`. */
typedef struct curlew_callbacks {
    void* user; /**< Handed to all of them. */
    /** How far the action has come, 0 … 1; called about 20 times a second, from any thread, one at a time. Anything but
        0 cancels the program. */
    int (*progress)(void* user, const char* title, double fraction);
    /** At the end of each frame of -frames, while what it has made is there; from the thread that called curlew_run().
        It may read what the session has, but not run or provide anything. Anything but 0 cancels the program. */
    int (*frame)(void* user, int32_t frame);
    /** What the program says (a line) or prints (with its line breaks); from the thread that called curlew_run(). */
    void (*message)(void* user, const char* text);
} curlew_callbacks;

/** Runs a program on what the session has. Returns when it is done, has failed or was cancelled; what it has made until
    then stays. `name` stands for the text in messages ("scene" if NULL); `callbacks` may be NULL. */
CURLEW_API curlew_status curlew_run(curlew_session* session, const char* text, const char* name,
                                    const curlew_callbacks* callbacks);

/** Runs a graph in place of all that the session has: as JSON ({"curlew": 1, "nodes": [{"name", "action", "words",
    "options", "inputs": {INPUT: [NAME, …]}}], "frames", "moment", "wanted", "effects"}, see docs/graph.md), or the text
    of a scene. Values of the run before whose node, options and inputs are the same are taken from there, so running an
    edited graph evaluates only what depends on the edit. Provided geometry counts by its content. */
CURLEW_API curlew_status curlew_run_graph(curlew_session* session, const char* graph, const char* name,
                                          const curlew_callbacks* callbacks);

/** The names of the nodes that the last run has evaluated, as a JSON list, without those whose values were known. It
    stays until the next call for the session. */
CURLEW_API curlew_status curlew_evaluated(const curlew_session* session, const char** json);

/** A graph or scene in the other form: "json" or "scene". It stays until the next call on this thread. Files that are
    not there are accepted. */
CURLEW_API curlew_status curlew_translate(const char* graph, const char* name, const char* form, const char** text);

/** Whether curlew_run() would begin to run the text, or curlew_run_graph() the graph: only what is wrong before
   anything is evaluated is found, and files that are not there are accepted. */
CURLEW_API curlew_status curlew_check(const char* text, const char* name);

/** Asks the program that the session runs to stop, from any thread. Where none runs, it does nothing. */
CURLEW_API curlew_status curlew_cancel(curlew_session* session);

/* --- results ---------------------------------------------------------------------------------------------------- */

/** What is on the stacks. Of each kind, age 0 is the newest. Where a function takes an age, it also takes the position
    of a node's result, which curlew_find() tells. */
typedef int32_t curlew_kind;
enum {
    CURLEW_FIELD = 0,
    CURLEW_FLOW = 1,
    CURLEW_GRID = 2,
    CURLEW_MESH = 3,
    CURLEW_POINTS = 4,
    CURLEW_CURVES = 5,
    CURLEW_IMAGE = 6
};

/** How many there are. */
CURLEW_API curlew_status curlew_count(const curlew_session* session, curlew_kind kind, int64_t* count);

/** The result of a node: "NAME", or "NAME.output" for one of several. The position is valid until the session runs
   again and, in a frame callback, until the callback returns. */
CURLEW_API curlew_status curlew_find(const curlew_session* session, const char* name, curlew_kind* kind,
                                     int64_t* position);

/** About one of them, as JSON, which stays until the next call for the session. Fields: {"dimension", "program"};
    flows: {"dimension", "tracks", "divergence_free", "lower", "upper"} (of the box of the domain); grids: {"name",
    "type", "value_type", "class", "voxel_size", "active_voxels", "level_set", "lower", "upper", "transform"} (as of
    curlew_grid_box(), and the matrix from indices to the world by rows); images: {"width", "height", "channels"}. All
   others, and images: "arrays": {NAME: {"type": "float32", "components", "count"}}, those that curlew_read() knows:

    points: "position" 3 float64; "id" 1 int64; and where they have them, "velocity" 3 float32, "age" and "life" 1
        float32 (seconds; infinite: it never dies), "fade" 1 float32 (0 to 1, how much of it is seen), "track" 2
        float64 (f and g), "converged" 1 int32.
    curves: "position" 3 float64, "velocity" 3 float32, "along" 1 float64 (distance or time from the seed) and "track"
        2 float64 of the vertices; "start" 1 int64, where each curve begins among them, and once more their number;
        "id" 1 int64, "closed" 1 int32 and "length" 1 float64 of the curves.
    mesh: "position" 3 float32; "triangles" 3 int32 and "quads" 4 int32, the corners of the faces.
    image: "pixels" float32, rows from top to bottom, a component for each channel; NaN: nothing is there. */
CURLEW_API curlew_status curlew_describe(const curlew_session* session, curlew_kind kind, int64_t age,
                                         const char** json);

/** Copies an array of one of them to a buffer of as many items and components. Floats are read as float32 or float64,
    integers as int32 or int64 (a value that does not fit is an error). */
CURLEW_API curlew_status curlew_read(const curlew_session* session, curlew_kind kind, int64_t age, const char* array,
                                     const curlew_buffer* buffer);

/** What the actions have measured, as JSON by action, which stays until the next call for the session. */
CURLEW_API curlew_status curlew_report(const curlew_session* session, const char** json);

/* --- grids ------------------------------------------------------------------------------------------------------ */

/** The box of the active voxels, in voxels; `upper` is exclusive. An empty grid has an empty box at the origin. */
CURLEW_API curlew_status curlew_grid_box(const curlew_session* session, int64_t age, int64_t lower[3],
                                         int64_t upper[3]);

/** Copies the values of a box, x slowest and z fastest, to a buffer of as many items: 1 or 3 components, floats for
   grids of real numbers and vectors, integers for those of integers. */
CURLEW_API curlew_status curlew_grid_read(const curlew_session* session, int64_t age, const int64_t lower[3],
                                          const int64_t upper[3], const curlew_buffer* buffer);

/** How many leaves a grid has: blocks of 8 x 8 x 8 voxels. */
CURLEW_API curlew_status curlew_grid_leaves(const curlew_session* session, int64_t age, int64_t* count);

/** A leaf without a copy: the voxel that it begins at, its 512 values (of the grid's "value_type", x slowest and z
    fastest; 3 numbers each for vectors), and 512 bits that tell which are active. Valid until the session runs again or
    is released, and in a frame callback until that returns. */
CURLEW_API curlew_status curlew_grid_leaf(const curlew_session* session, int64_t age, int64_t leaf, int64_t origin[3],
                                          const void** values, const uint64_t** active);

/* --- fields and flows ------------------------------------------------------------------------------------------- */

typedef struct curlew_field curlew_field;
typedef struct curlew_flow curlew_flow;

/** One of the session's fields. It lives on without the session. Release it. */
CURLEW_API curlew_status curlew_session_field(const curlew_session* session, int64_t age, curlew_field** field);

/** One of the session's flows, likewise. Of a flow that changes with time, as it is at the end of the program. */
CURLEW_API curlew_status curlew_session_flow(const curlew_session* session, int64_t age, curlew_flow** flow);

/** As curlew_session_release() does. Not while it is evaluated. */
CURLEW_API void curlew_field_release(curlew_field** field);
CURLEW_API void curlew_flow_release(curlew_flow** flow);

/** 1 to 7; 0 for NULL. */
CURLEW_API int32_t curlew_field_dimension(const curlew_field* field);
CURLEW_API int32_t curlew_flow_dimension(const curlew_flow* flow);

/** The field and its gradient, each of which may be NULL, at positions. Positions have as many components as the field
    has dimensions; or 3, where it has fewer (it is the same along the others). Values have 1 component, gradients as
    many as positions. Computed as float32 where all that is asked for is float32, else as float64; positions always
    count in full. Where a position is not finite, all is NaN. */
CURLEW_API curlew_status curlew_field_evaluate(const curlew_field* field, const curlew_array* positions,
                                               const curlew_buffer* values, const curlew_buffer* gradients);

/** The flow's velocity and its potentials, likewise. Potentials (f, g; in n dimensions n - 1 of them) are only there
    where the flow has tracks. A flow of 2 dimensions at positions of 3 has two. */
CURLEW_API curlew_status curlew_flow_evaluate(const curlew_flow* flow, const curlew_array* positions,
                                              const curlew_buffer* velocities, const curlew_buffer* potentials);

#ifdef __cplusplus
}
#endif

#endif
