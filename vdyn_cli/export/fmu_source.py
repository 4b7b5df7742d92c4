"""The FMI 2.0 functions around an exported C model, in C99; they declare the FMI types, so no FMI header is needed."""

from __future__ import annotations

from collections.abc import Sequence

from vdyn_cli.engine.c_lines import c_literal
from vdyn_cli.engine.c_source import CProgram

_TEMPLATE = r"""/* FMI 2.0 co-simulation interface of {name}.c. */
#include <math.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include "{name}.h"

#if defined(_WIN32)
#define EXPORT __declspec(dllexport)
#elif defined(__GNUC__)
#define EXPORT __attribute__((visibility("default")))
#else
#define EXPORT
#endif

/* The types of the standard that are needed here. */
typedef void *Component;
typedef unsigned int Reference;
typedef int Status;
enum {{ OK = 0, DISCARD = 2, FAILED = 3 }};

#define GUID "@GUID@"
#define LONGEST_STEP {step} /* s */
#define COUNT {count} /* variables: parameters, inputs, outputs, in this order */
#define FIRST_INPUT {first_input}
#define FIRST_OUTPUT {first_output}

typedef struct {{
    double start_speed;
    {name}_parameters p;
    {name}_input u, slope; /* inputs now, and their time derivatives */
    {name}_state x;
    {name}_output y;
    double time;
    int started; /* the state has left initialization */
    int fresh;   /* y is up to date with x, u and p */
}} Unit;

/* Offset of each variable in Unit, by its value reference. */
static const size_t place[COUNT] = {{
{places}
}};

static double *variable(Unit *m, Reference r)
{{
    return (double *)(void *)((char *)m + place[r]);
}}

static void reset(Unit *m)
{{
    memset(m, 0, sizeof *m);
    m->p = {name}_defaults;
}}

/* Update y; before the start, the state is initialized again for changed parameters and inputs. */
static void look(Unit *m)
{{
    if (m->fresh) {{
        return;
    }}
    if (!m->started) {{
        {name}_init(&m->x, &m->u, &m->p, m->start_speed);
    }}
    {name}_read(&m->x, &m->u, &m->p, &m->y);
    m->fresh = 1;
}}

EXPORT const char *fmi2GetTypesPlatform(void);
EXPORT const char *fmi2GetTypesPlatform(void)
{{
    return "default";
}}

EXPORT const char *fmi2GetVersion(void);
EXPORT const char *fmi2GetVersion(void)
{{
    return "2.0";
}}

EXPORT Component fmi2Instantiate(const char *instance, int type, const char *guid, const char *resources,
                                 const void *callbacks, int visible, int logging);
EXPORT Component fmi2Instantiate(const char *instance, int type, const char *guid, const char *resources,
                                 const void *callbacks, int visible, int logging)
{{
    Unit *m = NULL;
    (void)instance;
    (void)resources;
    (void)callbacks;
    (void)visible;
    (void)logging;
    if (type == 1 && guid && strcmp(guid, GUID) == 0) {{ /* 1: co-simulation */
        m = malloc(sizeof *m);
    }}
    if (m) {{
        reset(m);
    }}
    return m;
}}

EXPORT void fmi2FreeInstance(Component c);
EXPORT void fmi2FreeInstance(Component c)
{{
    free(c);
}}

EXPORT Status fmi2SetupExperiment(Component c, int tolerant, double tolerance, double start, int stops, double stop);
EXPORT Status fmi2SetupExperiment(Component c, int tolerant, double tolerance, double start, int stops, double stop)
{{
    (void)tolerant;
    (void)tolerance;
    (void)stops;
    (void)stop;
    ((Unit *)c)->time = start;
    return OK;
}}

EXPORT Status fmi2EnterInitializationMode(Component c);
EXPORT Status fmi2EnterInitializationMode(Component c)
{{
    (void)c;
    return OK;
}}

EXPORT Status fmi2ExitInitializationMode(Component c);
EXPORT Status fmi2ExitInitializationMode(Component c)
{{
    Unit *m = c;
    m->fresh = 0;
    look(m);
    m->started = 1;
    return OK;
}}

EXPORT Status fmi2Terminate(Component c);
EXPORT Status fmi2Terminate(Component c)
{{
    (void)c;
    return OK;
}}

EXPORT Status fmi2Reset(Component c);
EXPORT Status fmi2Reset(Component c)
{{
    reset(c);
    return OK;
}}

EXPORT Status fmi2GetReal(Component c, const Reference r[], size_t n, double value[]);
EXPORT Status fmi2GetReal(Component c, const Reference r[], size_t n, double value[])
{{
    size_t i;
    for (i = 0; i < n; i++) {{
        if (r[i] >= COUNT) {{
            return FAILED;
        }}
        if (r[i] >= FIRST_OUTPUT) {{
            look(c);
        }}
        value[i] = *variable(c, r[i]);
    }}
    return OK;
}}

EXPORT Status fmi2SetReal(Component c, const Reference r[], size_t n, const double value[]);
EXPORT Status fmi2SetReal(Component c, const Reference r[], size_t n, const double value[])
{{
    Unit *m = c;
    size_t i;
    for (i = 0; i < n; i++) {{
        if (r[i] >= FIRST_OUTPUT || (m->started && r[i] < FIRST_INPUT)) {{
            return FAILED; /* outputs are not set, and parameters only before the start */
        }}
        *variable(m, r[i]) = value[i];
    }}
    m->fresh = 0;
    return OK;
}}

EXPORT Status fmi2SetRealInputDerivatives(Component c, const Reference r[], size_t n, const int order[],
                                          const double value[]);
EXPORT Status fmi2SetRealInputDerivatives(Component c, const Reference r[], size_t n, const int order[],
                                          const double value[])
{{
    const size_t away = offsetof(Unit, slope) - offsetof(Unit, u);
    size_t i;
    for (i = 0; i < n; i++) {{
        if (order[i] != 1 || r[i] < FIRST_INPUT || r[i] >= FIRST_OUTPUT) {{
            return FAILED;
        }}
        *(double *)(void *)((char *)variable(c, r[i]) + away) = value[i];
    }}
    return OK;
}}

EXPORT Status fmi2DoStep(Component c, double time, double length, int forward);
EXPORT Status fmi2DoStep(Component c, double time, double length, int forward)
{{
    Unit *m = c;
    const {name}_input first = m->u;
    {name}_input before = first, after;
    {name}_output unread;
    const double parts = ceil(length / LONGEST_STEP - 1e-6);
    const double count = (parts > 1.0) ? parts : 1.0;
    double k;
    (void)forward;
    if (!(length > 0.0)) {{
        return FAILED;
    }}
    for (k = 1.0; k <= count; k += 1.0) {{
{moves}
        {name}_step(&m->x, &before, &after, length / count, &m->p, &unread);
        before = after;
    }}
    m->u = before; /* where the inputs have gone */
    memset(&m->slope, 0, sizeof m->slope); /* derivatives hold for one step */
    m->time = time + length;
    m->fresh = 0;
    return isfinite(m->x.speed) ? OK : FAILED;
}}

EXPORT Status fmi2GetFMUstate(Component c, void **state);
EXPORT Status fmi2GetFMUstate(Component c, void **state)
{{
    if (!*state) {{
        *state = malloc(sizeof(Unit));
    }}
    if (!*state) {{
        return FAILED;
    }}
    memcpy(*state, c, sizeof(Unit));
    return OK;
}}

EXPORT Status fmi2SetFMUstate(Component c, void *state);
EXPORT Status fmi2SetFMUstate(Component c, void *state)
{{
    memcpy(c, state, sizeof(Unit));
    return OK;
}}

EXPORT Status fmi2FreeFMUstate(Component c, void **state);
EXPORT Status fmi2FreeFMUstate(Component c, void **state)
{{
    (void)c;
    free(*state);
    *state = NULL;
    return OK;
}}

EXPORT Status fmi2GetStatus(Component c, int kind, Status *value);
EXPORT Status fmi2GetStatus(Component c, int kind, Status *value)
{{
    (void)c;
    (void)kind;
    (void)value;
    return DISCARD; /* no step is ever pending */
}}

EXPORT Status fmi2GetRealStatus(Component c, int kind, double *value);
EXPORT Status fmi2GetRealStatus(Component c, int kind, double *value)
{{
    if (kind != 2) {{ /* 2: time of the last good step */
        return DISCARD;
    }}
    *value = ((Unit *)c)->time;
    return OK;
}}

/* What the standard has and this model has no use for. */
{rest}
"""

_NONE = """EXPORT Status {0}({1});
EXPORT Status {0}({1})
{{
{2}
    return {3};
}}
"""

# Name, arguments, returned status. Calls for variables of other types are accepted only with empty lists.
_REST = (
    ("fmi2SetDebugLogging", "Component c, int on, size_t n, const char *const categories[]", "OK"),
    ("fmi2GetInteger", "Component c, const Reference r[], size_t n, int value[]", "n ? FAILED : OK"),
    ("fmi2GetBoolean", "Component c, const Reference r[], size_t n, int value[]", "n ? FAILED : OK"),
    ("fmi2GetString", "Component c, const Reference r[], size_t n, const char *value[]", "n ? FAILED : OK"),
    ("fmi2SetInteger", "Component c, const Reference r[], size_t n, const int value[]", "n ? FAILED : OK"),
    ("fmi2SetBoolean", "Component c, const Reference r[], size_t n, const int value[]", "n ? FAILED : OK"),
    ("fmi2SetString", "Component c, const Reference r[], size_t n, const char *const value[]", "n ? FAILED : OK"),
    ("fmi2SerializedFMUstateSize", "Component c, void *state, size_t *size", "FAILED"),
    ("fmi2SerializeFMUstate", "Component c, void *state, char bytes[], size_t size", "FAILED"),
    ("fmi2DeSerializeFMUstate", "Component c, const char bytes[], size_t size, void **state", "FAILED"),
    (
        "fmi2GetDirectionalDerivative",
        "Component c, const Reference of[], size_t n, const Reference by[], size_t m, const double seed[], "
        "double value[]",
        "FAILED",
    ),
    (
        "fmi2GetRealOutputDerivatives",
        "Component c, const Reference r[], size_t n, const int order[], double value[]",
        "n ? FAILED : OK",
    ),
    ("fmi2CancelStep", "Component c", "FAILED"),
    ("fmi2GetIntegerStatus", "Component c, int kind, int *value", "DISCARD"),
    ("fmi2GetBooleanStatus", "Component c, int kind, int *value", "DISCARD"),
    ("fmi2GetStringStatus", "Component c, int kind, const char **value", "DISCARD"),
)


def source(program: CProgram, variables: Sequence[str], step: float) -> str:
    """The C text of the wrapper; ``@GUID@`` is a placeholder for the GUID.

    Parameters
    ----------
    program : the exported model.
    variables : names by value reference: start_speed, the parameters, the inputs, the outputs.
    step : s, the longest step of the model; a communication step is divided into equal parts of at most this length.
    """
    groups = (("p", program.parameters), ("u", program.inputs), ("y", program.outputs))
    members = ["start_speed", *(f"{group}.{field}" for group, fields in groups for field in fields)]
    assert len(members) == len(variables)
    moves = [f"        after.{f} = first.{f} + m->slope.{f} * (length * (k / count));" for f in program.inputs]
    first_input = 1 + len(program.parameters)
    return _TEMPLATE.format(
        name=program.name,
        step=c_literal(step),
        count=len(members),
        first_input=first_input,
        first_output=first_input + len(program.inputs),
        places="\n".join(f"    offsetof(Unit, {member})," for member in members),
        moves="\n".join(moves),
        rest="\n".join(_nothing(*entry) for entry in _REST),
    )


def _nothing(name: str, arguments: str, result: str) -> str:
    names = [part.split()[-1].strip("*[]") for part in arguments.split(", ")]
    unused = [f"    (void){n};" for n in names if n != result.split()[0]]
    return _NONE.format(name, arguments, "\n".join(unused), result)
