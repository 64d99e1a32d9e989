// SPDX-License-Identifier: Apache-2.0
#include "Preamble.h"

#include <array>

namespace curlew {

namespace {

struct Helper {
    std::string_view name; ///< As it is called.
    std::string_view text;
};

// In the subset of GLSL that translated() takes.

// Functions of reals, accurate to about 1e-7: languages for shaders require much less of their own. Each is reduced to
// a small interval; the polynomials there are near-minimax fits. A helper may call those before it.

constexpr std::array kHelpers{
    Helper{"flowQuarter", R"(
// The sine of x and, a quarter turn on, the cosine.
float flowQuarter(float x, uint quarters) {
    float whole = roundEven(x * 0.63661977);
    float r = ((x - whole * 1.5703125) - whole * 0.00048375129) - whole * 7.54979e-08;
    float s = r * r;
    float sine = r + r * s * (-0.16666665 + s * (0.008332743 + s * -0.00019586958));
    float cosine = 1.0 - 0.5 * s + s * s * (0.041666664 + s * (-0.0013888269 + s * 2.4543295e-05));
    uint turns = uint(int(whole)) + quarters;
    float value = sine;
    if ((turns & 1u) != 0u) {
        value = cosine;
    }
    if ((turns & 2u) != 0u) {
        value = -value;
    }
    return value;
}
)"},
    Helper{"flowSin", R"(float flowSin(float x) {
    return flowQuarter(x, 0u);
}
)"},
    Helper{"flowCos", R"(float flowCos(float x) {
    return flowQuarter(x, 1u);
}
)"},
    Helper{"flowExp", R"(
float flowExp(float x) {
    float whole = clamp(roundEven(x * 1.442695), -126.0, 127.0);
    float r = (x - whole * 0.693145752) - whole * 1.42860677e-06;
    float power = 1.0 + (r + r * r * (0.5 + r * (0.16666573 + r * (0.041666364 + r * (0.008363776 + r * 0.0013942157)))));
    return power * uintBitsToFloat(uint(int(whole) + 127) << 23u);
}
)"},
    Helper{"flowLog", R"(
float flowLog(float x) {
    uint bits = floatBitsToUint(x) - 0x3f3504f3u; // of the square root of 1/2
    float whole = float(int(bits) >> 23);
    float f = uintBitsToFloat((bits & 0x7fffffu) + 0x3f3504f3u) - 1.0;
    float s = f / (2.0 + f);
    float z = s * s;
    float value = 2.0 * s * (1.0 + z * (0.33333334 + z * (0.2 + z * (0.14285715 + z * 0.11111111))));
    if (x > 0.0) {
        return (value + whole * 1.42860677e-06) + whole * 0.693145752;
    }
    return -1.0 / abs(x);
}
)"},
    Helper{"flowAtan", R"(
float flowAtan(float x) {
    float size = abs(x);
    float base = 0.0;
    float y = size;
    if (size > 2.4142135) {
        base = 1.5707964;
        y = -1.0 / size;
    } else if (size > 0.41421357) {
        base = 0.78539819;
        y = (size - 1.0) / (size + 1.0);
    }
    float z = y * y;
    float value =
        base + (y + y * z * (-0.33333332 + z * (0.19999525 + z * (-0.14263734 + z * (0.10742495 + z * -0.064494245)))));
    if (x < 0.0) {
        return -value;
    }
    return value;
}
)"},
    Helper{"flowAsin", R"(
float flowAsin(float x) {
    float size = abs(x);
    float y = size;
    if (size > 0.5) {
        y = sqrt(0.5 - 0.5 * size);
    }
    float z = y * y;
    float value = y + y * z * (0.16666666 + z * (0.075001110 + z * (0.044594855 + z * (0.031148219 + z *
                  (0.016939924 + z * 0.034018018)))));
    if (size > 0.5) {
        value = 1.5707964 - 2.0 * value;
    }
    if (x < 0.0) {
        return -value;
    }
    return value;
}
)"},
    Helper{"flowAcos", R"(float flowAcos(float x) {
    if (x > 0.5) {
        return 2.0 * flowAsin(sqrt(0.5 - 0.5 * x));
    }
    return 1.5707964 - flowAsin(x);
}
)"},
    Helper{"flowSinh", R"(float flowSinh(float x) {
    float power = flowExp(abs(x));
    float square = x * x;
    float value = 0.5 * power - 0.5 / power;
    if (abs(x) < 0.5) {
        value = abs(x) * (1.0 + square * (0.16666667 + square * (0.0083333333 + square * 0.0001984127)));
    }
    if (x < 0.0) {
        return -value;
    }
    return value;
}
)"},
    Helper{"flowCosh", R"(float flowCosh(float x) {
    float power = flowExp(abs(x));
    return 0.5 * power + 0.5 / power;
}
)"},
    Helper{"flowTanh", R"(float flowTanh(float x) {
    float value = 1.0 - 2.0 / (flowExp(2.0 * min(abs(x), 20.0)) + 1.0);
    if (x < 0.0) {
        return -value;
    }
    return value;
}
)"},
    Helper{"flowPow", R"(float flowPow(float x, float power) {
    return flowExp(power * flowLog(x));
}
)"},
    Helper{"flowLongAdd", R"(
// Words of 64 bits: x is the low half.
uvec2 flowLongAdd(uvec2 a, uvec2 b) {
    uint low = a.x + b.x;
    return uvec2(low, a.y + b.y + uint(low < a.x));
}
)"},
    Helper{"flowLongSub", R"(uvec2 flowLongSub(uvec2 a, uvec2 b) {
    return uvec2(a.x - b.x, a.y - b.y - uint(a.x < b.x));
}
)"},
    Helper{"flowLongMul", R"(uvec2 flowLongMul(uvec2 a, uvec2 b) {
    uint al = a.x & 0xffffu;
    uint ah = a.x >> 16u;
    uint bl = b.x & 0xffffu;
    uint bh = b.x >> 16u;
    uint low = al * bl;
    uint left = ah * bl;
    uint right = al * bh;
    uint middle = (low >> 16u) + (left & 0xffffu) + (right & 0xffffu);
    uint high = ah * bh + (left >> 16u) + (right >> 16u) + (middle >> 16u);
    return uvec2((low & 0xffffu) | (middle << 16u), high + a.x * b.y + a.y * b.x);
}
)"},
};

// GPUs add faster than they round and convert: at this size, a sum is an integer. The driver must not remove the
// addition.
constexpr std::array kNearestHelpers{
    Helper{"flowNearest", R"(
// The integer nearest to a number below 2^22. Faster with a macro flowZero: a uint that is 0, which the driver does not
// know.
float flowNearest(float x) {
#ifdef flowZero
    return uintBitsToFloat(floatBitsToUint(x + 12582912.0) ^ flowZero) - 12582912.0;
#else
    return roundEven(x);
#endif
}
)"},
};

constexpr std::array kDoubleHelpers{
    Helper{"flowNearest", R"(
// The same below 2^51.
double flowNearest(double x) {
#ifdef flowZero
    uvec2 sum = unpackDouble2x32(x + 6755399441055744.0lf);
    return packDouble2x32(uvec2(sum.x ^ flowZero, sum.y)) - 6755399441055744.0lf;
#else
    return roundEven(x);
#endif
}
)"},
    Helper{"flowInteger", R"(
// An integer below 2^51 as a word of 64 bits.
uvec2 flowInteger(double x) {
    uvec2 sum = unpackDouble2x32(x + 6755399441055744.0lf);
    return uvec2(sum.x, sum.y - 0x43380000u);
}
)"},
};

// Pairs of floats whose sum has 48 bits (Dekker 1971, Knuth 1969). They need additions that the compiler neither
// reorders nor removes: flowKept() returns its argument, but the compiler cannot know that. `precise` does not suffice:
// NVIDIA's driver for Vulkan (580) removes the constant from (x + c) - c.
constexpr std::array kPairHelpers{
    Helper{"flowKept", R"(
float flowKept(float x) {
    return uintBitsToFloat(floatBitsToUint(x) ^ flowZero);
}
)"},
    Helper{"flowPairFrom", R"(// The pair of a number and a smaller one.
vec2 flowPairFrom(float high, float low) {
    float sum = flowKept(high + low);
    return vec2(sum, low - flowKept(sum - high));
}
)"},
    Helper{"flowPairSum", R"(vec2 flowPairSum(float a, float b) {
    float sum = flowKept(a + b);
    float part = flowKept(sum - a);
    return vec2(sum, flowKept(a - flowKept(sum - part)) + flowKept(b - part));
}
)"},
    Helper{"flowPairProduct", R"(vec2 flowPairProduct(float a, float b) {
    float product = flowKept(a * b);
    float ah = uintBitsToFloat(floatBitsToUint(a) & 0xfffff000u);
    float al = flowKept(a - ah);
    float bh = uintBitsToFloat(floatBitsToUint(b) & 0xfffff000u);
    float bl = flowKept(b - bh);
    float rest = flowKept(flowKept(ah * bh) - product);
    rest = flowKept(rest + flowKept(ah * bl));
    rest = flowKept(rest + flowKept(al * bh));
    return vec2(product, rest + al * bl);
}
)"},
    Helper{"flowPairAdd", R"(vec2 flowPairAdd(vec2 a, vec2 b) {
    vec2 high = flowPairSum(a.x, b.x);
    return flowPairFrom(high.x, high.y + (a.y + b.y));
}
)"},
    Helper{"flowPairSub", R"(vec2 flowPairSub(vec2 a, vec2 b) {
    return flowPairAdd(a, -b);
}
)"},
    Helper{"flowPairMul", R"(vec2 flowPairMul(vec2 a, vec2 b) {
    vec2 product = flowPairProduct(a.x, b.x);
    return flowPairFrom(product.x, product.y + (a.x * b.y + a.y * b.x));
}
)"},
    Helper{"flowPairMulAdd", R"(vec2 flowPairMulAdd(vec2 a, vec2 b, vec2 c) {
    return flowPairAdd(flowPairMul(a, b), c);
}
)"},
    Helper{"flowPairDiv", R"(vec2 flowPairDiv(vec2 a, vec2 b) {
    float first = a.x / b.x;
    vec2 rest = flowPairSub(a, flowPairMul(b, vec2(first, 0.0)));
    float second = rest.x / b.x;
    rest = flowPairSub(rest, flowPairMul(b, vec2(second, 0.0)));
    return flowPairAdd(flowPairFrom(first, second), vec2(rest.x / b.x, 0.0));
}
)"},
    Helper{"flowPairFloor", R"(vec2 flowPairFloor(vec2 a) {
    float whole = floor(a.x);
    if (whole == a.x) {
        return flowPairFrom(whole, floor(a.y));
    }
    return vec2(whole, 0.0);
}
)"},
    Helper{"flowPairNearest", R"(vec2 flowPairNearest(vec2 a) {
    float whole = roundEven(a.x);
    if (whole == a.x) {
        return flowPairFrom(whole, roundEven(a.y));
    }
    return vec2(whole, 0.0);
}
)"},
    Helper{"flowPairAbs", R"(vec2 flowPairAbs(vec2 a) {
    if (a.x < 0.0) {
        return -a;
    }
    return a;
}
)"},
    Helper{"flowPairLess", R"(bool flowPairLess(vec2 a, vec2 b) {
    return a.x < b.x || (a.x == b.x && a.y < b.y);
}
)"},
    Helper{"flowPairLessEqual", R"(bool flowPairLessEqual(vec2 a, vec2 b) {
    return a.x < b.x || (a.x == b.x && a.y <= b.y);
}
)"},
    Helper{"flowPairEqual", R"(bool flowPairEqual(vec2 a, vec2 b) {
    return a.x == b.x && a.y == b.y;
}
)"},
    Helper{"flowPairMin", R"(vec2 flowPairMin(vec2 a, vec2 b) {
    if (flowPairLess(a, b)) {
        return a;
    }
    return b;
}
)"},
    Helper{"flowPairMax", R"(vec2 flowPairMax(vec2 a, vec2 b) {
    if (flowPairLess(b, a)) {
        return a;
    }
    return b;
}
)"},
    Helper{"flowPairOf", R"(vec2 flowPairOf(uint word) {
    return flowPairFrom(float(word >> 16u) * 65536.0, float(word & 0xffffu));
}
)"},
    Helper{"flowInteger", R"(
// An integer, |x| < 2^31, as a word of 64 bits; the low half is right up to 2^47.
uvec2 flowInteger(vec2 x) {
    float high = floor(x.x * 1.52587890625e-05);
    float rest = x.x - high * 65536.0;
    return uvec2((uint(int(high)) << 16u) + uint(int(rest)) + uint(int(x.y)), uint(x.x < 0.0) * 0xffffffffu);
}
)"},
};

/// Puts before the text those helpers that it calls. A helper calls only those before it.
template <size_t N>
void prepend(const std::array<Helper, N>& helpers, std::string& preamble, const std::string& text) {
    for (auto helper = helpers.rbegin(); helper != helpers.rend(); ++helper) {
        const std::string call = std::string(helper->name) + "(";
        if (preamble.find(call) != std::string::npos || text.find(call) != std::string::npos)
            preamble.insert(0, helper->text);
    }
}

} // namespace

std::string preambleFor(const std::string& text, Dialect dialect, ShaderCoordinates coordinates) {
    std::string preamble;
    prepend(kHelpers, preamble, text);
    if (dialect == Dialect::glsl) prepend(kNearestHelpers, preamble, text);
    if (coordinates == ShaderCoordinates::doubles)
        prepend(kDoubleHelpers, preamble, text);
    else
        prepend(kPairHelpers, preamble, text);
    return preamble;
}

} // namespace curlew
