MODULE tools
  PERS tooldata tFixed:=[FALSE,[[0,0,100],[1,0,0,0]],[1,[0,0,1],[1,0,0,0],0,0,0]];
  PERS tooldata tGun:=[TRUE,[[30,0,120],[0.9659258,0,0.2588190,0]],[1,[0,0,1],[1,0,0,0],0,0,0]];
  PERS wobjdata wTurn:=[FALSE,FALSE,"STN1",[[0,0,0],[1,0,0,0]],[[0,0,0],[1,0,0,0]]];
  CONST robtarget p1:=[[818.7,147.3,858.2],[0,-0.97969618,0,0.20048792],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget p2:=[[818.7,147.3,858.2],[0,-0.97969618,0,0.20048792],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget p3:=[[818.7,147.3,858.2],[0,-0.97969618,0,0.20048792],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget p4:=[[818.7,147.3,758.2],[0,-0.97969618,0,0.20048792],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PROC main()
    MoveL p1,v100,fine,tFixed;
    MoveL p2,v100,fine,tool0\WObj:=wTurn;
    MoveL p3,v100,fine,tool0;
    MoveL p3,v100,fine,tGun;
    IF DI1=1 THEN
      MoveL p4,v100,fine,tGun;
    ENDIF
  ENDPROC
ENDMODULE
