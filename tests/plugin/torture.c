/* SPDX-License-Identifier: Apache-2.0 */
/* Longer than 400 lines, because it calls every function of curlew.h with every kind of wrong argument. */
/* Each misuse must fail with a message and leave the session usable. */
#include "Check.h"
#include "curlew.h"

#include <math.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>

/* The call must fail with this status and a message that contains `part`. */
#define FAILS(call, expected, part)                                                                         \
    do {                                                                                                    \
        const curlew_status got = (call);                                                                   \
        CHECK(got == (expected));                                                                           \
        CHECK(curlew_error_status() == (expected));                                                         \
        if (!strstr(curlew_error_message(), part)) {                                                        \
            ++failures;                                                                                     \
            fprintf(stderr, "%s:%d: '%s' has no '%s'\n", __FILE__, __LINE__, curlew_error_message(), part); \
        }                                                                                                   \
    } while (0)
#define SUCCEEDS(call)                                                                                   \
    do {                                                                                                 \
        if ((call) != CURLEW_OK) {                                                                       \
            ++failures;                                                                                  \
            fprintf(stderr, "%s:%d: %s fails: %s\n", __FILE__, __LINE__, #call, curlew_error_message()); \
        }                                                                                                \
    } while (0)

static const char* const kEndless = "advect steps=1e9";
static const char* const kFlow = "noise\nnoise seed=1\ndfvn speed=1\n";

static curlew_session* newSession(void) {
    curlew_session* session = NULL;
    SUCCEEDS(curlew_session_create(&session));
    return session;
}

/* The field x, and two that are wrong. */
static int plane(void* user, int64_t count, const double* positions, double* values, double* gradients) {
    int64_t k;
    (void)user;
    for (k = 0; k < count; ++k) {
        values[k] = positions[3 * k];
        gradients[3 * k] = 1;
        gradients[3 * k + 1] = gradients[3 * k + 2] = 0;
    }
    return 0;
}
static int wrongPlane(void* user, int64_t count, const double* positions, double* values, double* gradients) {
    int64_t k;
    const int status = plane(user, count, positions, values, gradients);
    for (k = 0; k < 3 * count; ++k) gradients[k] *= 2;
    return status;
}
static int failing(void* user, int64_t count, const double* positions, double* values, double* gradients) {
    return plane(user, count, positions, values, gradients) + 1;
}

static void providedFields(void) {
    curlew_session* session = newSession();
    int64_t flows = 0;
    SUCCEEDS(curlew_provide_field(session, "a plane", 3, plane, NULL, 1));
    SUCCEEDS(curlew_run(session, "read 'a plane'\nnoise\ndfvn\n", NULL, NULL));
    SUCCEEDS(curlew_count(session, CURLEW_FLOW, &flows));
    CHECK(flows == 1);
    SUCCEEDS(curlew_withdraw(session, "a plane"));
    SUCCEEDS(curlew_session_release(&session));
}

static void nullPointers(void) {
    curlew_session* session = newSession();
    curlew_session* none = NULL;
    curlew_field* field = NULL;
    curlew_flow* flow = NULL;
    const char* text = NULL;
    int64_t count = 0;
    curlew_kind kind = 0;
    double numbers[6] = {0};
    const curlew_array array = {numbers, 2, 0, 3, CURLEW_FLOAT64};
    const curlew_buffer buffer = {numbers, 2, 0, 3, CURLEW_FLOAT64};
    FAILS(curlew_session_create(NULL), CURLEW_VALUE_ERROR, "NULL");
    FAILS(curlew_provide_mesh(NULL, "a", &array, &array, NULL), CURLEW_VALUE_ERROR, "session is NULL");
    FAILS(curlew_provide_mesh(session, NULL, &array, &array, NULL), CURLEW_VALUE_ERROR, "name is NULL");
    FAILS(curlew_provide_mesh(session, "a", NULL, &array, NULL), CURLEW_VALUE_ERROR, "points is NULL");
    FAILS(curlew_provide_mesh(session, "a", &array, NULL, NULL), CURLEW_VALUE_ERROR, "corners is NULL");
    FAILS(curlew_provide_points(NULL, "a", &array, NULL, NULL), CURLEW_VALUE_ERROR, "NULL");
    FAILS(curlew_provide_points(session, "", &array, NULL, NULL), CURLEW_VALUE_ERROR, "empty");
    FAILS(curlew_provide_points(session, "a", NULL, NULL, NULL), CURLEW_VALUE_ERROR, "positions is NULL");
    FAILS(curlew_provide_field(NULL, "a", 3, plane, NULL, 1), CURLEW_VALUE_ERROR, "session is NULL");
    FAILS(curlew_provide_field(session, NULL, 3, plane, NULL, 1), CURLEW_VALUE_ERROR, "name is NULL");
    FAILS(curlew_provide_field(session, "a", 3, NULL, NULL, 1), CURLEW_VALUE_ERROR, "function");
    FAILS(curlew_provide_field(session, "a", 8, plane, NULL, 1), CURLEW_VALUE_ERROR, "8 dimensions");
    FAILS(curlew_provide_field(session, "a", 3, wrongPlane, NULL, 1), CURLEW_VALUE_ERROR, "gradients");
    FAILS(curlew_provide_field(session, "a", 3, failing, NULL, 1), CURLEW_VALUE_ERROR, "'a' has failed");
    FAILS(curlew_withdraw(NULL, "a"), CURLEW_VALUE_ERROR, "NULL");
    FAILS(curlew_withdraw(session, "a"), CURLEW_VALUE_ERROR, "nothing has been provided as 'a'");
    FAILS(curlew_run(NULL, "noise", NULL, NULL), CURLEW_VALUE_ERROR, "NULL");
    FAILS(curlew_run(session, NULL, NULL, NULL), CURLEW_VALUE_ERROR, "text is NULL");
    FAILS(curlew_check(NULL, NULL), CURLEW_VALUE_ERROR, "NULL");
    FAILS(curlew_run_graph(NULL, "{}", NULL, NULL), CURLEW_VALUE_ERROR, "session is NULL");
    FAILS(curlew_run_graph(session, NULL, NULL, NULL), CURLEW_VALUE_ERROR, "graph is NULL");
    FAILS(curlew_evaluated(NULL, &text), CURLEW_VALUE_ERROR, "NULL");
    FAILS(curlew_evaluated(session, NULL), CURLEW_VALUE_ERROR, "NULL");
    FAILS(curlew_translate(NULL, NULL, "json", &text), CURLEW_VALUE_ERROR, "NULL");
    FAILS(curlew_translate("noise", NULL, NULL, &text), CURLEW_VALUE_ERROR, "NULL");
    FAILS(curlew_translate("noise", NULL, "json", NULL), CURLEW_VALUE_ERROR, "NULL");
    FAILS(curlew_find(NULL, "a", &kind, &count), CURLEW_VALUE_ERROR, "NULL");
    FAILS(curlew_find(session, NULL, &kind, &count), CURLEW_VALUE_ERROR, "NULL");
    FAILS(curlew_grid_leaves(NULL, 0, &count), CURLEW_VALUE_ERROR, "NULL");
    FAILS(curlew_grid_leaves(session, 0, &count), CURLEW_VALUE_ERROR, "grid");
    FAILS(curlew_cancel(NULL), CURLEW_VALUE_ERROR, "NULL");
    FAILS(curlew_count(NULL, CURLEW_FIELD, &count), CURLEW_VALUE_ERROR, "NULL");
    FAILS(curlew_count(session, CURLEW_FIELD, NULL), CURLEW_VALUE_ERROR, "NULL");
    FAILS(curlew_describe(session, CURLEW_FIELD, 0, NULL), CURLEW_VALUE_ERROR, "NULL");
    FAILS(curlew_describe(NULL, CURLEW_FIELD, 0, &text), CURLEW_VALUE_ERROR, "NULL");
    FAILS(curlew_read(session, CURLEW_POINTS, 0, NULL, &buffer), CURLEW_VALUE_ERROR, "NULL");
    FAILS(curlew_read(NULL, CURLEW_POINTS, 0, "id", &buffer), CURLEW_VALUE_ERROR, "NULL");
    FAILS(curlew_report(NULL, &text), CURLEW_VALUE_ERROR, "NULL");
    FAILS(curlew_report(session, NULL), CURLEW_VALUE_ERROR, "NULL");
    FAILS(curlew_session_field(session, 0, NULL), CURLEW_VALUE_ERROR, "NULL");
    FAILS(curlew_session_flow(NULL, 0, &flow), CURLEW_VALUE_ERROR, "NULL");
    FAILS(curlew_field_evaluate(NULL, &array, NULL, NULL), CURLEW_VALUE_ERROR, "NULL");
    FAILS(curlew_flow_evaluate(NULL, &array, NULL, NULL), CURLEW_VALUE_ERROR, "NULL");
    CHECK(curlew_field_dimension(NULL) == 0 && curlew_flow_dimension(NULL) == 0);
    curlew_session_release(NULL);
    curlew_session_release(&none);
    curlew_field_release(NULL);
    curlew_field_release(&field);
    curlew_flow_release(NULL);
    curlew_flow_release(&flow);
    curlew_session_release(&session);
    curlew_session_release(&session); /* NULL by now: no effect */
    CHECK(session == NULL);
}

static void wrongPrograms(void) {
    curlew_session* session = newSession();
    int64_t count = 0;
    FAILS(curlew_run(session, "noise\n\nnoize\n", "x.txt", NULL), CURLEW_VALUE_ERROR, "did you mean 'noise'");
    CHECK(curlew_error_line() == 3 && strcmp(curlew_error_action(), "noize") == 0);
    CHECK(strstr(curlew_error_message(), "x.txt:3"));
    FAILS(curlew_run(session, "noise seed=-1", NULL, NULL), CURLEW_VALUE_ERROR, "seed=-1");
    CHECK(curlew_error_line() == 1 && strcmp(curlew_error_action(), "noise") == 0);
    FAILS(curlew_run(session, "noise\n# dfvn\n  dfvn \\\n speed=1", NULL, NULL), CURLEW_VALUE_ERROR, "-dfvn");
    CHECK(curlew_error_line() == 3 && strcmp(curlew_error_action(), "dfvn") == 0);
    FAILS(curlew_run(session, "scatter box=0,0,0,1,1,1 count=9\nwrite /no/such/folder/a.vdb", NULL, NULL),
          CURLEW_FILE_ERROR, "/no/such/folder");
    CHECK(curlew_error_line() == 2 && strcmp(curlew_error_action(), "write") == 0);
    FAILS(curlew_run(session, "sphere\nread missing.obj", NULL, NULL), CURLEW_FILE_ERROR, "missing.obj");
    FAILS(curlew_run(session, "read strange", NULL, NULL), CURLEW_VALUE_ERROR, "no known extension");
    FAILS(curlew_run(session, "\xff\xfe noise", NULL, NULL), CURLEW_VALUE_ERROR, "no action");
    FAILS(curlew_run(session, "noise \"", NULL, NULL), CURLEW_VALUE_ERROR, "quote");
    FAILS(curlew_run(session, "frames 1-2\nframes 1-2\nnoise", NULL, NULL), CURLEW_VALUE_ERROR, "twice");
    CHECK(curlew_error_line() == 2);
    FAILS(curlew_run(session, "scatter box=0,0,0,1,1,1 count=1e14", NULL, NULL), CURLEW_RESOURCE_ERROR, "memory");
    FAILS(curlew_check("noise\nnoise freqency=1", NULL), CURLEW_VALUE_ERROR, "did you mean 'frequency'");
    CHECK(curlew_error_line() == 2);
    SUCCEEDS(curlew_check("noise\nread missing.obj\n", NULL));
    SUCCEEDS(curlew_run(session, "", NULL, NULL));
    SUCCEEDS(curlew_run(session, "help\nlist format=json\nversion\nverbose\nnoise\nprint", NULL,
                        NULL)); /* prints nothing, as there are no callbacks */
    SUCCEEDS(curlew_count(session, CURLEW_FIELD, &count));
    CHECK(count > 0); /* the session is still usable */
    curlew_session_release(&session);
}

static void wrongGraphs(void) {
    curlew_session* session = newSession();
    const char* text = NULL;
    curlew_kind kind = 0;
    int64_t position = 0, again = -1;
    char deep[4000];
    FAILS(curlew_run_graph(session, "{", NULL, NULL), CURLEW_VALUE_ERROR, "JSON");
    FAILS(curlew_run_graph(session, "{\"nodes\": 1}", NULL, NULL), CURLEW_VALUE_ERROR, "list");
    FAILS(curlew_run_graph(session, "{\"knots\": []}", NULL, NULL), CURLEW_VALUE_ERROR, "'knots'");
    FAILS(curlew_run_graph(session, "{\"curlew\": 99}", NULL, NULL), CURLEW_VALUE_ERROR, "version 99");
    FAILS(curlew_run_graph(session, "{\"nodes\": [{\"name\": \"a\", \"action\": \"noize\"}]}", NULL, NULL),
          CURLEW_VALUE_ERROR, "did you mean 'noise'");
    CHECK(curlew_error_line() == 0 && strcmp(curlew_error_node(), "a") == 0);
    FAILS(curlew_run_graph(session,
                           "{\"nodes\": [{\"name\": \"a\", \"action\": \"noise\", \"options\": {\"seed\": -1}}]}", NULL,
                           NULL),
          CURLEW_VALUE_ERROR, "seed=-1");
    CHECK(strcmp(curlew_error_node(), "a") == 0 && strcmp(curlew_error_action(), "noise") == 0);
    FAILS(curlew_run_graph(session,
                           "{\"nodes\": [{\"name\": \"a\", \"action\": \"clip\", \"inputs\": {\"field\": [\"a\"]}}]}",
                           NULL, NULL),
          CURLEW_VALUE_ERROR, "cycle");
    memset(deep, '[', sizeof deep - 1);
    deep[sizeof deep - 1] = 0;
    memcpy(deep, "{\"nodes\":", 9);
    FAILS(curlew_run_graph(session, deep, NULL, NULL), CURLEW_VALUE_ERROR, "");
    FAILS(curlew_run_graph(session, "\xff\xfe{", NULL, NULL), CURLEW_VALUE_ERROR, "");
    FAILS(curlew_check("{\"nodes\": [{\"action\": \"dfvn\"}]}", NULL), CURLEW_VALUE_ERROR, "-dfvn");
    SUCCEEDS(curlew_check("{\"nodes\": [{\"action\": \"read\", \"words\": [\"missing.obj\"]}]}", NULL));
    FAILS(curlew_translate("noise", NULL, "xml", &text), CURLEW_VALUE_ERROR, "json or scene");
    CHECK(text == NULL);
    FAILS(curlew_translate("noise\nnoize", "x.txt", "json", &text), CURLEW_VALUE_ERROR, "x.txt:2");
    SUCCEEDS(curlew_translate("noise seed=1\nslice width=4\n", NULL, "json", &text));
    CHECK(text && strstr(text, "\"action\": \"slice\""));
    SUCCEEDS(curlew_run_graph(session, text, NULL, NULL)); /* translated text can be run */
    SUCCEEDS(curlew_evaluated(session, &text));
    CHECK(strstr(text, "noise") && strstr(text, "slice"));
    SUCCEEDS(curlew_run_graph(session, "noise seed=1\nslice width=4\n", NULL, NULL)); /* a scene is accepted too */
    SUCCEEDS(curlew_evaluated(session, &text));
    CHECK(strcmp(text, "[]") == 0);
    SUCCEEDS(curlew_find(session, "slice", &kind, &position));
    CHECK(kind == CURLEW_IMAGE);
    FAILS(curlew_find(session, "slice", NULL, &position), CURLEW_VALUE_ERROR, "NULL");
    FAILS(curlew_find(session, "slice", &kind, NULL), CURLEW_VALUE_ERROR, "NULL");
    SUCCEEDS(curlew_describe(session, kind, position, &text));
    CHECK(strstr(text, "\"width\":4"));
    SUCCEEDS(curlew_find(session, "slice", &kind, &again));
    CHECK(again == position);
    FAILS(curlew_find(session, "slise", &kind, &position), CURLEW_VALUE_ERROR, "did you mean 'slice'");
    FAILS(curlew_find(session, "slice.mask", &kind, &position), CURLEW_VALUE_ERROR, "'mask'");
    FAILS(curlew_describe(session, CURLEW_IMAGE, 1 << 20, &text), CURLEW_VALUE_ERROR, "image");
    curlew_session_release(&session);
}

static void wrongMeshes(void) {
    curlew_session* session = newSession();
    double points[4][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    int64_t faces[4][3] = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}};
    int32_t sizes[2] = {3, 9}, few[2] = {2, 10};
    curlew_array p = {points, 4, 0, 3, CURLEW_FLOAT64}, f = {faces, 4, 0, 3, CURLEW_INT64};
    const curlew_array list = {faces, 12, 0, 1, CURLEW_INT64}, n = {sizes, 2, 0, 1, CURLEW_INT32},
                       tooFew = {few, 2, 0, 1, CURLEW_INT32}, short1 = {sizes, 1, 0, 1, CURLEW_INT32};
    int64_t count = 0;
    SUCCEEDS(curlew_provide_mesh(session, "m", &p, &f, NULL));
    SUCCEEDS(curlew_provide_mesh(session, "m", &p, &list, &n)); /* a polygon with repeated vertices */
    FAILS(curlew_provide_mesh(session, "m", &p, &list, &tooFew), CURLEW_VALUE_ERROR, "2 corners");
    FAILS(curlew_provide_mesh(session, "m", &p, &list, &short1), CURLEW_VALUE_ERROR, "3 corners");
    FAILS(curlew_provide_mesh(session, "m", &p, &list, NULL), CURLEW_VALUE_ERROR, "3 or 4 components");
    FAILS(curlew_provide_mesh(session, "m", &f, &f, NULL), CURLEW_VALUE_ERROR, "float");
    FAILS(curlew_provide_mesh(session, "m", &p, &p, NULL), CURLEW_VALUE_ERROR, "int");
    points[2][1] = NAN;
    FAILS(curlew_provide_mesh(session, "m", &p, &f, NULL), CURLEW_VALUE_ERROR, "not a finite number");
    points[2][1] = INFINITY;
    FAILS(curlew_provide_mesh(session, "m", &p, &f, NULL), CURLEW_VALUE_ERROR, "not a finite number");
    points[2][1] = 1e300; /* infinite as a float */
    FAILS(curlew_provide_mesh(session, "m", &p, &f, NULL), CURLEW_VALUE_ERROR, "not finite");
    points[2][1] = 1;
    faces[3][2] = 4;
    FAILS(curlew_provide_mesh(session, "m", &p, &f, NULL), CURLEW_VALUE_ERROR, "there are 4");
    faces[3][2] = -1;
    FAILS(curlew_provide_mesh(session, "m", &p, &f, NULL), CURLEW_VALUE_ERROR, "-1");
    faces[3][2] = INT64_MAX;
    FAILS(curlew_provide_mesh(session, "m", &p, &f, NULL), CURLEW_VALUE_ERROR, "cannot be");
    faces[3][2] = 3;
    f.count = 0;
    FAILS(curlew_provide_mesh(session, "m", &p, &f, NULL), CURLEW_VALUE_ERROR, "no faces");
    f.count = -4;
    FAILS(curlew_provide_mesh(session, "m", &p, &f, NULL), CURLEW_VALUE_ERROR, "-4 items");
    f.count = 4;
    p.count = INT64_MAX;
    FAILS(curlew_provide_mesh(session, "m", &p, &f, NULL), CURLEW_VALUE_ERROR, "items");
    p.count = INT64_C(1) << 40;
    FAILS(curlew_provide_mesh(session, "m", &p, &f, NULL), CURLEW_RESOURCE_ERROR, "memory");
    p.count = 4;
    p.data = NULL;
    FAILS(curlew_provide_mesh(session, "m", &p, &f, NULL), CURLEW_VALUE_ERROR, "no data");
    p.data = points;
    p.type = 17;
    FAILS(curlew_provide_mesh(session, "m", &p, &f, NULL), CURLEW_VALUE_ERROR, "type");
    p.type = CURLEW_FLOAT64;
    p.components = 2;
    FAILS(curlew_provide_mesh(session, "m", &p, &f, NULL), CURLEW_VALUE_ERROR, "3 components");
    p.components = 3;
    SUCCEEDS(curlew_provide_mesh(session, "m", &p, &f, NULL));
    SUCCEEDS(curlew_run(session, "read m m\nmesh2ls dim=16\n", NULL, NULL));
    SUCCEEDS(curlew_count(session, CURLEW_MESH, &count));
    CHECK(count == 1);
    SUCCEEDS(curlew_withdraw(session, "m"));
    FAILS(curlew_run(session, "read m", NULL, NULL), CURLEW_VALUE_ERROR, "no known extension");
    curlew_session_release(&session);
}

static void wrongPoints(void) {
    curlew_session* session = newSession();
    float positions[3][3] = {{0, 0, 0}, {0.5f, 0, 0}, {0, 0.5f, 0}};
    int32_t ids[3] = {7, 5, -3};
    int64_t read[3] = {0};
    const curlew_array p = {positions, 3, 0, 3, CURLEW_FLOAT32}, i = {ids, 3, 0, 1, CURLEW_INT32},
                       fewer = {ids, 2, 0, 1, CURLEW_INT32}, fewerV = {positions, 2, 0, 3, CURLEW_FLOAT32},
                       none = {NULL, 0, 0, 3, CURLEW_FLOAT32},
                       backward = {positions[2], 3, -(int64_t)sizeof positions[0], 3, CURLEW_FLOAT32};
    const curlew_buffer id = {read, 3, 0, 1, CURLEW_INT64};
    float first[3];
    double all[3][3];
    const curlew_buffer back = {all, 3, 0, 3, CURLEW_FLOAT64};
    FAILS(curlew_provide_points(session, "p", &p, &fewer, NULL), CURLEW_VALUE_ERROR, "3 positions, but 2 ids");
    FAILS(curlew_provide_points(session, "p", &p, NULL, &fewerV), CURLEW_VALUE_ERROR, "2 velocities");
    SUCCEEDS(curlew_provide_points(session, "none", &none, NULL, NULL));
    SUCCEEDS(curlew_run(session, "noise\nnoise seed=1\ndfvn\nread none\nadvect steps=2\n", NULL, NULL));
    SUCCEEDS(curlew_provide_points(session, "p", &p, &i, &p));
    SUCCEEDS(curlew_run(session, "read p\nadvect steps=2\n", NULL, NULL));
    SUCCEEDS(curlew_read(session, CURLEW_POINTS, 0, "id", &id));
    CHECK(read[0] == 7 && read[1] == 5 && read[2] == -3);
    SUCCEEDS(curlew_provide_points(session, "backward", &backward, NULL, NULL));
    SUCCEEDS(curlew_run(session, "read backward", NULL, NULL));
    SUCCEEDS(curlew_read(session, CURLEW_POINTS, 0, "position", &back));
    for (int axis = 0; axis < 3; ++axis) first[axis] = (float)all[0][axis];
    CHECK(memcmp(first, positions[2], sizeof first) == 0);
    curlew_session_release(&session);
}

static void wrongCurves(void) {
    curlew_session* session = newSession();
    float positions[4][3] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {NAN, 0, 0}};
    int32_t ends[3][2] = {{1, 2}, {0, 1}, {2, 2}}, outside[1][2] = {{0, 4}}, negative[1][2] = {{0, -1}},
            toNaN[1][2] = {{0, 3}};
    int64_t start[2] = {1, 1};
    const curlew_array p = {positions, 4, 0, 3, CURLEW_FLOAT32}, finite = {positions, 3, 0, 3, CURLEW_FLOAT32},
                       e = {ends, 2, 0, 2, CURLEW_INT32}, loop = {ends, 3, 0, 2, CURLEW_INT32},
                       far = {outside, 1, 0, 2, CURLEW_INT32}, below = {negative, 1, 0, 2, CURLEW_INT32},
                       bad = {toNaN, 1, 0, 2, CURLEW_INT32}, single = {ends, 2, 0, 1, CURLEW_INT32},
                       none = {NULL, 0, 0, 2, CURLEW_INT32};
    const curlew_buffer to = {start, 2, 0, 1, CURLEW_INT64};
    FAILS(curlew_provide_curves(NULL, "c", &p, &e), CURLEW_VALUE_ERROR, "NULL");
    FAILS(curlew_provide_curves(session, "c", &p, NULL), CURLEW_VALUE_ERROR, "edges is NULL");
    FAILS(curlew_provide_curves(session, "c", &p, &single), CURLEW_VALUE_ERROR, "edges");
    FAILS(curlew_provide_curves(session, "c", &finite, &loop), CURLEW_VALUE_ERROR, "edge 2 joins vertex 2 to itself");
    FAILS(curlew_provide_curves(session, "c", &finite, &far), CURLEW_VALUE_ERROR,
          "edge 0 has vertex 4, but there are 3");
    FAILS(curlew_provide_curves(session, "c", &p, &below), CURLEW_VALUE_ERROR, "edges[0] cannot be -1");
    FAILS(curlew_provide_curves(session, "c", &p, &bad), CURLEW_VALUE_ERROR, "positions[3] is not a finite number");
    SUCCEEDS(curlew_provide_curves(session, "none", &finite, &none));
    SUCCEEDS(curlew_provide_curves(session, "c", &finite, &e));
    SUCCEEDS(curlew_run(session, "read c\nrail radius=0.1 keep=1\nread none\n", NULL, NULL));
    SUCCEEDS(curlew_read(session, CURLEW_CURVES, 1, "start", &to));
    CHECK(start[0] == 0 && start[1] == 3);
    curlew_session_release(&session);
}

static void wrongReads(void) {
    curlew_session* session = newSession();
    double numbers[20][3];
    int32_t small[10];
    curlew_buffer b = {numbers, 10, 0, 3, CURLEW_FLOAT64};
    const curlew_buffer ids = {small, 10, 0, 1, CURLEW_INT32};
    const int64_t large[1] = {INT64_C(1) << 40};
    const double origin[1][3] = {{0, 0, 0}};
    const curlew_array p = {origin, 1, 0, 3, CURLEW_FLOAT64}, i = {large, 1, 0, 1, CURLEW_INT64};
    const curlew_buffer one = {small, 1, 0, 1, CURLEW_INT32};
    const curlew_buffer none = {NULL, 0, 0, 1, CURLEW_FLOAT64};
    const int64_t low[3] = {0, 0, 0}, high[3] = {1 << 30, 1 << 30, 16}, least[3] = {-(1 << 30), 0, 0};
    const char* text = NULL;
    int64_t count = 0;
    FAILS(curlew_read(session, CURLEW_POINTS, 0, "position", &b), CURLEW_VALUE_ERROR, "no points");
    SUCCEEDS(curlew_run(session, "scatter box=0,0,0,1,1,1 count=10", NULL, NULL));
    FAILS(curlew_read(session, CURLEW_POINTS, 1, "position", &b), CURLEW_VALUE_ERROR, "points of age 1");
    FAILS(curlew_read(session, CURLEW_POINTS, -1, "position", &b), CURLEW_VALUE_ERROR, "-1");
    FAILS(curlew_read(session, CURLEW_POINTS, 0, "colour", &b), CURLEW_VALUE_ERROR, "there are position, id");
    FAILS(curlew_read(session, CURLEW_POINTS, 0, "position", NULL), CURLEW_VALUE_ERROR, "NULL");
    FAILS(curlew_read(session, CURLEW_FIELD, 0, "position", &b), CURLEW_VALUE_ERROR, "no field");
    FAILS(curlew_read(session, 99, 0, "position", &b), CURLEW_VALUE_ERROR, "kind 99");
    FAILS(curlew_count(session, -1, &count), CURLEW_VALUE_ERROR, "kind -1");
    FAILS(curlew_describe(session, CURLEW_FLOW, 0, &text), CURLEW_VALUE_ERROR, "no flow");
    CHECK(text == NULL);
    b.count = 9;
    FAILS(curlew_read(session, CURLEW_POINTS, 0, "position", &b), CURLEW_VALUE_ERROR, "10 items, not 9");
    b.count = 10;
    b.stride = 8;
    FAILS(curlew_read(session, CURLEW_POINTS, 0, "position", &b), CURLEW_VALUE_ERROR, "overlap");
    b.stride = 0;
    b.type = CURLEW_INT64;
    FAILS(curlew_read(session, CURLEW_POINTS, 0, "position", &b), CURLEW_VALUE_ERROR, "float");
    b.type = CURLEW_FLOAT64;
    b.data = NULL;
    FAILS(curlew_read(session, CURLEW_POINTS, 0, "position", &b), CURLEW_VALUE_ERROR, "no data");
    b.data = numbers;
    SUCCEEDS(curlew_read(session, CURLEW_POINTS, 0, "position", &b));
    SUCCEEDS(curlew_read(session, CURLEW_POINTS, 0, "id", &ids));
    SUCCEEDS(curlew_provide_points(session, "p", &p, &i, NULL));
    SUCCEEDS(curlew_run(session, "read p", NULL, NULL));
    FAILS(curlew_read(session, CURLEW_POINTS, 0, "id", &one), CURLEW_VALUE_ERROR, "does not fit int32");
    /* boxes whose number of voxels is 2^64 or 2^31, which wraps to 0 or below */
    SUCCEEDS(curlew_run(session, "noise\nbake box=0,0,0,1,1,1 dim=4", NULL, NULL));
    FAILS(curlew_grid_read(session, 0, low, high, &none), CURLEW_VALUE_ERROR, "2^31 voxels");
    FAILS(curlew_grid_read(session, 0, least, high, &none), CURLEW_VALUE_ERROR, "2^31 voxels");
    FAILS(curlew_grid_read(session, 0, high, low, &none), CURLEW_VALUE_ERROR, "empty");
    curlew_session_release(&session);
}

static void wrongPositions(void) {
    curlew_session* session = newSession();
    curlew_field* field = NULL;
    curlew_flow* flow = NULL;
    double positions[5][3] = {
        {0.3, 0.2, 0.1}, {NAN, 0, 0}, {0, INFINITY, 0}, {1e300, -1e300, 1e18}, {-0.0, 1e-310, 4e9}};
    double values[5], gradients[5][3], velocities[5][3];
    float single[5];
    curlew_array p = {positions, 5, 0, 3, CURLEW_FLOAT64};
    const curlew_array plane = {positions, 5, sizeof positions[0], 2, CURLEW_FLOAT64};
    const curlew_buffer v = {values, 5, 0, 1, CURLEW_FLOAT64}, g = {gradients, 5, 0, 3, CURLEW_FLOAT64},
                        s = {single, 5, 0, 1, CURLEW_FLOAT32}, u = {velocities, 5, 0, 3, CURLEW_FLOAT64},
                        wrong = {values, 5, 0, 2, CURLEW_FLOAT64}, few = {values, 4, 0, 1, CURLEW_FLOAT64};
    FAILS(curlew_session_field(session, 0, &field), CURLEW_VALUE_ERROR, "no field");
    FAILS(curlew_session_flow(session, -1, &flow), CURLEW_VALUE_ERROR, "-1");
    SUCCEEDS(curlew_run(session, kFlow, NULL, NULL));
    SUCCEEDS(curlew_run(session, "uniform\nsuperpose keep=1\nnoise dimensions=2\n", NULL, NULL));
    FAILS(curlew_session_field(session, 1, &field), CURLEW_VALUE_ERROR, "no field of age 1");
    CHECK(field == NULL);
    SUCCEEDS(curlew_session_field(session, 0, &field));
    SUCCEEDS(curlew_session_flow(session, 0, &flow));
    curlew_session_release(&session); /* field and flow stay valid */
    CHECK(curlew_field_dimension(field) == 2 && curlew_flow_dimension(flow) == 3);
    FAILS(curlew_field_evaluate(field, NULL, &v, NULL), CURLEW_VALUE_ERROR, "positions is NULL");
    FAILS(curlew_field_evaluate(field, &p, &wrong, NULL), CURLEW_VALUE_ERROR, "1 component, not 2");
    FAILS(curlew_field_evaluate(field, &p, &few, NULL), CURLEW_VALUE_ERROR, "5 items, not 4");
    FAILS(curlew_field_evaluate(field, &plane, &v, &g), CURLEW_VALUE_ERROR, "2 components, not 3");
    FAILS(curlew_flow_evaluate(flow, &plane, &u, NULL), CURLEW_VALUE_ERROR, "3 components, not 2");
    FAILS(curlew_flow_evaluate(flow, &p, NULL, &wrong), CURLEW_VALUE_ERROR, "no tracks");
    SUCCEEDS(curlew_field_evaluate(field, &p, NULL, NULL));
    SUCCEEDS(curlew_field_evaluate(field, &plane, &v, NULL)); /* 2D positions for the 2D field */
    SUCCEEDS(curlew_field_evaluate(field, &p, &s, NULL));     /* 3D positions are accepted too */
    SUCCEEDS(curlew_field_evaluate(field, &p, &v, &g));
    CHECK(fabs(values[0] - (double)single[0]) < 1e-5 && values[0] != 0);
    CHECK(gradients[0][2] == 0 && gradients[0][0] != 0);
    for (int k = 1; k < 3; ++k)
        CHECK(isnan(values[k]) && isnan(single[k]) && isnan(gradients[k][0]) && isnan(gradients[k][2]));
    SUCCEEDS(curlew_flow_evaluate(flow, &p, &u, NULL));
    CHECK(isnan(velocities[1][0]) && !isnan(velocities[0][0]));
    p.count = 0;
    p.data = NULL;
    {
        const curlew_buffer empty = {NULL, 0, 0, 1, CURLEW_FLOAT64};
        SUCCEEDS(curlew_field_evaluate(field, &p, &empty, NULL));
    }
    curlew_field_release(&field);
    curlew_flow_release(&flow);
    CHECK(field == NULL && flow == NULL);
}

/* --- cancelling --------------------------------------------------------------------------------------------------- */

typedef struct calls {
    curlew_session* session;
    int progress, frames, after, cancelInside;
} calls;

static int countProgress(void* user, const char* title, double fraction) {
    calls* c = user;
    (void)title, (void)fraction;
    return ++c->progress > c->after;
}

static int countFrames(void* user, int32_t frame) {
    calls* c = user;
    int64_t count = 0;
    ++c->frames;
    SUCCEEDS(curlew_count(c->session, CURLEW_IMAGE, &count)); /* the results of the frame are available */
    CHECK(count >= 1);
    FAILS(curlew_run(c->session, "noise", NULL, NULL), CURLEW_VALUE_ERROR, "running");
    FAILS(curlew_withdraw(c->session, "x"), CURLEW_VALUE_ERROR, "running");
    FAILS(curlew_session_release(&c->session), CURLEW_VALUE_ERROR, "running");
    CHECK(c->session != NULL);
    if (c->cancelInside && frame == 2) SUCCEEDS(curlew_cancel(c->session));
    return !c->cancelInside && frame == 3;
}

static void* cancelSoon(void* session) {
    curlew_session* s = session;
    int64_t count = 0;
    while (curlew_count(s, CURLEW_FIELD, &count) == CURLEW_OK) continue; /* waits until the program runs */
    CHECK(strstr(curlew_error_message(), "running"));
    FAILS(curlew_session_release(&s), CURLEW_VALUE_ERROR, "running");
    SUCCEEDS(curlew_cancel(s));
    return NULL;
}

static void cancelling(void) {
    curlew_session* session = newSession();
    calls c = {session, 0, 0, 2, 0};
    curlew_callbacks callbacks = {&c, countProgress, NULL, NULL};
    int64_t count = 0;
    pthread_t other;
    SUCCEEDS(curlew_run(session, kFlow, NULL, NULL));
    SUCCEEDS(curlew_run(session, "scatter count=1000", NULL, NULL));
    FAILS(curlew_run(session, kEndless, NULL, &callbacks), CURLEW_CANCELLED, "cancelled");
    CHECK(c.progress == 3 && curlew_error_line() == 1 && strcmp(curlew_error_action(), "advect") == 0);
    FAILS(curlew_run(session, "velocity dim=300", NULL, &callbacks), CURLEW_CANCELLED, "cancelled");
    SUCCEEDS(curlew_count(session, CURLEW_GRID, &count));
    CHECK(count == 0);
    c.progress = 0;
    c.after = 0;
    FAILS(curlew_run(session, "quiet\nnoise\nnoise", NULL, &callbacks), CURLEW_CANCELLED, "cancelled");
    c.after = 1 << 30;
    callbacks.frame = countFrames;
    FAILS(curlew_run(session, "frames 1-9\nslice width=4", NULL, &callbacks), CURLEW_CANCELLED, "cancelled");
    CHECK(c.frames == 3);
    c.frames = 0;
    c.cancelInside = 1;
    FAILS(curlew_run(session, "frames 1-9\nslice width=4", NULL, &callbacks), CURLEW_CANCELLED, "cancelled");
    CHECK(c.frames == 2);
    CHECK(pthread_create(&other, NULL, cancelSoon, session) == 0);
    FAILS(curlew_run(session, kEndless, NULL, NULL), CURLEW_CANCELLED, "cancelled");
    pthread_join(other, NULL);
    SUCCEEDS(curlew_run(session, "velocity dim=8", NULL, NULL)); /* the session is still usable */
    curlew_session_release(&session);
}

/* --- threads ------------------------------------------------------------------------------------------------------ */

static const double tetrahedron[4][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
static const int64_t sides[4][3] = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}};
enum { kThreads = 4, kMany = 5000 };
static curlew_flow* shared = NULL;
static double at[kMany][3], expected[kMany][3];

/* Errors are separate for each thread, and a program gives the same numbers while others run. */
static void* work(void* number) {
    const int n = *(const int*)number;
    char wrong[32], name[32];
    static double positions[kThreads][500][3];
    for (int round = 0; round < 3; ++round) {
        curlew_session* session = newSession();
        const curlew_buffer p = {positions[n], 500, 0, 3, CURLEW_FLOAT64};
        static double velocities[kThreads][kMany][3];
        const curlew_array where = {at, kMany, 0, 3, CURLEW_FLOAT64}, corners = {tetrahedron, 4, 0, 3, CURLEW_FLOAT64},
                           faces = {sides, 4, 0, 3, CURLEW_INT64};
        const curlew_buffer v = {velocities[n], kMany, 0, 3, CURLEW_FLOAT64};
        sprintf(wrong, "%.*sfoo%d", n, "\n\n\n\n", n);
        sprintf(name, "'-foo%d'", n);
        FAILS(curlew_run(session, wrong, NULL, NULL), CURLEW_VALUE_ERROR, name);
        CHECK(curlew_error_line() == n + 1);
        SUCCEEDS(curlew_flow_evaluate(shared, &where, &v, NULL));
        CHECK(memcmp(velocities[n], expected, sizeof expected) == 0);
        CHECK(strstr(curlew_error_message(), name) && curlew_error_line() == n + 1); /* kept until the next failure */
        SUCCEEDS(curlew_run(session, n % 2 == 0 ? "threads 1" : "verbose", NULL, NULL));
        SUCCEEDS(curlew_provide_mesh(session, "tetrahedron", &corners, &faces, NULL));
        SUCCEEDS(curlew_run(session,
                            "read tetrahedron\nmesh2ls dim=16\nnoise alpha={pi/4}\nnoise seed=1\nbound layer=0.2\n"
                            "dfvn speed=1\nvelocity dim=16\nscatter count=500\nadvect steps=3\ncheck samples=100\n",
                            NULL, NULL));
        SUCCEEDS(curlew_read(session, CURLEW_POINTS, 0, "position", &p));
        curlew_session_release(&session);
    }
    return positions[n];
}

static void threads(void) {
    curlew_session* session = newSession();
    pthread_t ids[kThreads];
    int numbers[kThreads];
    void* results[kThreads];
    const curlew_array where = {at, kMany, 0, 3, CURLEW_FLOAT64};
    const curlew_buffer v = {expected, kMany, 0, 3, CURLEW_FLOAT64};
    for (int k = 0; k < kMany; ++k)
        for (int axis = 0; axis < 3; ++axis) at[k][axis] = sin(12.9898 * k + 4.1 * axis);
    SUCCEEDS(curlew_run(session, kFlow, NULL, NULL));
    SUCCEEDS(curlew_session_flow(session, 0, &shared));
    SUCCEEDS(curlew_flow_evaluate(shared, &where, &v, NULL));
    for (int n = 0; n < kThreads; ++n) {
        numbers[n] = n;
        CHECK(pthread_create(&ids[n], NULL, work, &numbers[n]) == 0);
    }
    for (int n = 0; n < kThreads; ++n) pthread_join(ids[n], &results[n]);
    for (int n = 1; n < kThreads; ++n) CHECK(memcmp(results[0], results[n], 500 * 3 * sizeof(double)) == 0);
    curlew_flow_release(&shared);
    curlew_session_release(&session);
}

int main(void) {
    CHECK(curlew_error_status() == CURLEW_OK && strcmp(curlew_error_message(), "") == 0);
    nullPointers();
    providedFields();
    wrongPrograms();
    wrongGraphs();
    wrongMeshes();
    wrongPoints();
    wrongCurves();
    wrongReads();
    wrongPositions();
    cancelling();
    threads();
    return failures == 0 ? 0 : 1;
}
