/* Elementary functions without calls or tables: compilers turn loops over them into vector code, and every digit is the
   same on every machine and vector width (no fused products: -ffp-contract=off). Polynomials interpolate at Chebyshev
   points; errors are within 2 units in the last place. */

#ifndef PETCONTACT_ELEMENTARY_H
#define PETCONTACT_ELEMENTARY_H

#include <math.h>
#include <stdint.h>
#include <string.h>

#if defined(__x86_64__) && defined(__gnu_linux__) && defined(__GNUC__) && !defined(__clang__) && __GNUC__ >= 12 &&          \
    !defined(PETCONTACT_ONE_LEVEL)
/* one copy for each level of the processor, chosen when the library is loaded */
#define PETCONTACT_LEVELS
#define DISPATCHED __attribute__((target_clones("default", "arch=x86-64-v3", "arch=x86-64-v4")))
#else
#define DISPATCHED
#endif
#if defined(__GNUC__) && !defined(__clang__)
/* without two passes that find nothing here, and took half the time to compile (they are quadratic in long functions) */
#pragma GCC optimize("O3", "no-gcse", "no-gcse-after-reload")
#endif
#define INLINE static inline __attribute__((always_inline))

static const double PI = 3.14159265358979323846;

INLINE int64_t bits_of(double x)
{
    int64_t i;
    memcpy(&i, &x, sizeof i);
    return i;
}
INLINE double double_of(int64_t i)
{
    double x;
    memcpy(&x, &i, sizeof x);
    return x;
}

/* Four numbers side by side, wherever they lie in memory. More than a register of AVX2 holds GCC 12 takes apart through memory:
   eight at a time are two to five times as slow there. */
typedef double Quad __attribute__((vector_size(4 * sizeof(double)), aligned(sizeof(double)), may_alias));

/* Products of eight numbers added to as many interleaved partial sums. */
INLINE void add_products(const double *x, const double *y, Quad *sum)
{
    sum[0] += *(const Quad *)x * *(const Quad *)y;
    sum[1] += *(const Quad *)(x + 4) * *(const Quad *)(y + 4);
}

INLINE double total(const Quad *sum)
{
    const Quad both = sum[0] + sum[1];
    return (both[0] + both[2]) + (both[1] + both[3]);
}

/* 2 atanh(s) for |s| <= 0.1716, that is ln((1+s)/(1-s)) up to a ratio of √2. */
INLINE double twice_atanh(double s)
{
    double z = s * s;
    double p = 0.1461644995652156;
    p = p * z + 0.1533172157859257;
    p = p * z + 0.1818288912592248;
    p = p * z + 0.2222221113478601;
    p = p * z + 0.2857142862597554;
    p = p * z + 0.39999999999899505;
    p = p * z + 0.666666666666667;
    return 2.0 * s + s * z * p;
}

/* ln x for normal x > 0; at zero a number below every logarithm (-709.8). */
INLINE double logarithm(double x)
{
    const int64_t root_half = 0x3fe6a09e667f3bcd, one = 0x3ff0000000000000;
    int64_t i = bits_of(x) + (one - root_half); /* exponent of x over √½, biased */
    int64_t biased = (int64_t)((uint64_t)i >> 52);
    double m = double_of(bits_of(x) - (biased << 52) + one); /* in [√½, √2) */
    double k = double_of(biased | 0x4330000000000000) - (4503599627370496.0 + 1023.0);
    return k * 0.6931471805598903 + (twice_atanh((m - 1.0) / (m + 1.0)) + k * 5.497923018708371e-14);
}

/* e^x for |x| <= 700. */
INLINE double power_of_e(double x)
{
    const double shift = 6755399441055744.0; /* 1.5·2^52 rounds to whole numbers */
    const double k = (x * 1.4426950408889634 + shift) - shift;
    const double r = (x - k * 0.6931471805598903) - k * 5.497923018708371e-14; /* |r| <= ln(2)/2 */
    double p = 1.6059043836821613e-10;
    p = p * r + 2.08767569878681e-09;
    p = p * r + 2.505210838544172e-08;
    p = p * r + 2.755731922398589e-07;
    p = p * r + 2.7557319223985893e-06;
    p = p * r + 2.48015873015873e-05;
    p = p * r + 0.0001984126984126984;
    p = p * r + 0.001388888888888889;
    p = p * r + 0.008333333333333333;
    p = p * r + 0.041666666666666664;
    p = p * r + 0.16666666666666666;
    p = p * r + 0.5;
    p = p * r + 1.0;
    p = p * r + 1.0;
    return p * double_of((int64_t)((uint64_t)(bits_of(k + shift) + 1023) << 52));
}

/* arsinh x. */
INLINE double area_sinh(double x)
{
    return copysign(logarithm(fabs(x) + sqrt(x * x + 1.0)), x);
}

/* The angle of the vector (x, y), in [-π, π]; 0 where both vanish. */
INLINE double angle_of(double y, double x)
{
    double ay = fabs(y), ax = fabs(x);
    double low = ay < ax ? ay : ax, high = ay < ax ? ax : ay;
    int turned = low > 0.41421356237309503 * high; /* beyond π/8 the angle to the diagonal is the smaller one */
    double numerator = turned ? low - high : low, denominator = turned ? low + high : high;
    double t = numerator / (denominator == 0.0 ? 1.0 : denominator), z = t * t;
    double p = -0.019176884154115826;
    p = p * z + 0.039231655874580044;
    p = p * z - 0.050854496541382486;
    p = p * z + 0.05858148896788035;
    p = p * z - 0.0666451144553849;
    p = p * z + 0.07692183190695215;
    p = p * z - 0.09090904578118268;
    p = p * z + 0.11111111015256223;
    p = p * z - 0.14285714284666542;
    p = p * z + 0.1999999999999552;
    p = p * z - 0.3333333333333333;
    double angle = (turned ? 0.25 * PI : 0.0) + (t + t * z * p);
    angle = ay > ax ? 0.5 * PI - angle : angle;
    angle = x < 0.0 ? PI - angle : angle;
    return copysign(angle, y);
}

#endif
