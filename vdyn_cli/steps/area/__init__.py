"""Frontal area from a silhouette picture and the size of the box around it.

Area = silhouette pixels / box pixels x box area x ((D + d)/D)^2: the camera stands D in front of the box, the car's
widest section d behind it (d < 0: in front), so the car appears smaller than the box by D/(D + d). With the whole
picture as box this is 84.2 % of 2.60 m^2 = 2.19 m^2 in SAE 2017-01-1574.

Pixels at the edge count by the share that the car covers: the outline of a car crosses some 2 000 pixels, and a
threshold that counts only whole pixels shifts the area by a fraction of them. The area includes the tires and excludes
the mirrors (the definition of the EPA's road-load forms): fold them, cut them out with ``exclude``, or mask them.

Assumes a camera on the car's axis, at half the height of the car, without lens distortion. The uncertainty contains
box size and corners, camera distance and depth, and the position of the edge within the picture's blur. Where the
silhouette extends below the box, shadow or floor may also close the gap between the wheels: what is below the box and
up to 0.3 m above its lower edge, beyond the width of two tires, then counts by half, and the interval includes all and
none of it. Sources: SAE 2017-01-1574; Otsu, IEEE Trans. SMC 9 (1979) 62 for the threshold.
"""
